//! Encrypted connections.

use super::Certificate;
use super::identity::Identity;
use crate::error::BridgeError;
use crate::locked::locked;
use rustls::{ServerConfig, ServerConnection};
use std::io::{self, Read, Write};
use std::sync::{Arc, Mutex};

/// What a server needs to encrypt its connections.
pub(crate) struct Security {
    config: Arc<ServerConfig>,
    fingerprint: String,
    is_self_signed: bool,
}

impl Security {
    /// Reads the certificate and its key, or makes them.
    pub(crate) fn open(certificate: &Certificate) -> Result<Self, BridgeError> {
        if !graviola::util::is_cpu_supported() {
            return Err(BridgeError::Processor);
        }
        let Identity {
            certificates,
            key,
            fingerprint,
        } = Identity::open(certificate)?;
        let refused = |source: rustls::Error| BridgeError::Certificate {
            path: certificate.key_path().to_owned(),
            reason: match source {
                rustls::Error::InconsistentKeys(_) => {
                    "the key does not fit the certificate".to_owned()
                }
                other => other.to_string(),
            },
        };
        let provider = Arc::new(rustls_graviola::default_provider());
        let config = ServerConfig::builder_with_provider(provider)
            .with_protocol_versions(&[&rustls::version::TLS13])
            .map_err(refused)?
            .with_no_client_auth()
            .with_single_cert(certificates, key)
            .map_err(refused)?;
        Ok(Self {
            config: Arc::new(config),
            fingerprint,
            is_self_signed: matches!(certificate, Certificate::SelfSigned(_)),
        })
    }

    /// A new connection, before its handshake.
    pub(crate) fn session(&self) -> io::Result<Session> {
        let connection = ServerConnection::new(Arc::clone(&self.config));
        let mut connection = connection.map_err(io::Error::other)?;
        // No limit, because a message with a scene can be long and must be sent at once.
        connection.set_buffer_limit(None);
        Ok(Session(Mutex::new(connection)))
    }

    /// SHA-256 of the certificate, as browsers show it.
    pub(crate) fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    /// Names by which browsers may reach a server with a certificate that it made.
    pub(crate) fn names(&self) -> Vec<String> {
        match self.is_self_signed {
            true => super::made::names(),
            false => Vec::new(),
        }
    }

    pub(crate) const fn is_self_signed(&self) -> bool {
        self.is_self_signed
    }
}

/// The state of an encrypted connection. Never locked while waiting for a socket.
pub(crate) struct Session(Mutex<ServerConnection>);

impl Session {
    pub(crate) fn is_handshaking(&self) -> bool {
        locked(&self.0).is_handshaking()
    }

    pub(crate) fn has_to_send(&self) -> bool {
        locked(&self.0).wants_write()
    }

    /// Adds the end of the connection to what is sent next.
    pub(crate) fn end(&self) {
        locked(&self.0).send_close_notify();
    }

    /// Takes received bytes: at most 1024, and only after everything was [opened](Self::opened), so that they fit.
    pub(crate) fn take(&self, mut received: &[u8]) -> io::Result<()> {
        let mut connection = locked(&self.0);
        while !received.is_empty() {
            // Ignore bytes after the client has closed.
            if connection.read_tls(&mut received)? == 0 {
                break;
            }
            connection
                .process_new_packets()
                .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
        }
        Ok(())
    }

    /// Decrypts received bytes into `buffer`; returns their number, 0 after the client has closed, `None` if more must be received first.
    pub(crate) fn opened(&self, buffer: &mut [u8]) -> io::Result<Option<usize>> {
        match locked(&self.0).reader().read(buffer) {
            Ok(count) => Ok(Some(count)),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// All pending output, followed by these bytes, encrypted.
    pub(crate) fn sealed(&self, bytes: &[u8]) -> io::Result<Vec<u8>> {
        let mut connection = locked(&self.0);
        connection.writer().write_all(bytes)?;
        let mut sealed = Vec::with_capacity(bytes.len() + 64);
        while connection.wants_write() {
            connection.write_tls(&mut sealed)?;
        }
        Ok(sealed)
    }
}
