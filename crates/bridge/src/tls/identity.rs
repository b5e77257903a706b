//! A server's certificate and key, from files.

use super::{Certificate, made};
use crate::error::BridgeError;
use graviola::hashing::{Hash, Sha256};
use hwall_files::Beside;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;

/// Longest file that is read, bytes: chains have a few thousand.
const LONGEST: u64 = 1 << 20;

pub(super) struct Identity {
    pub(super) certificates: Vec<CertificateDer<'static>>,
    pub(super) key: PrivateKeyDer<'static>,
    /// SHA-256 of the first certificate, in pairs of hexadecimal digits.
    pub(super) fingerprint: String,
}

impl Identity {
    pub(super) fn open(certificate: &Certificate) -> Result<Self, BridgeError> {
        match certificate {
            Certificate::Own { certificates, key } => {
                Self::from_pem((certificates, &read(certificates)?), (key, &read(key)?))
            }
            Certificate::SelfSigned(path) => {
                if !path.exists() {
                    make(path)?;
                }
                let pem = read(path)?;
                Self::from_pem((path, &pem), (path, &pem))
            }
        }
    }

    fn from_pem(certificates: (&Path, &[u8]), key: (&Path, &[u8])) -> Result<Self, BridgeError> {
        let malformed = |path: &Path, what: &str| BridgeError::Certificate {
            path: path.to_owned(),
            reason: format!("{what} in PEM was expected"),
        };
        let chain: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(certificates.1).collect();
        let chain = chain.ok().filter(|chain| !chain.is_empty());
        let chain = chain.ok_or_else(|| malformed(certificates.0, "a certificate"))?;
        let (key_path, key) = key;
        let key = PrivateKeyDer::from_pem_slice(key);
        let fingerprint: Vec<String> = Sha256::hash(&chain[0])
            .as_ref()
            .iter()
            .map(|byte| format!("{byte:02X}"))
            .collect();
        Ok(Self {
            certificates: chain,
            key: key.map_err(|_| malformed(key_path, "an unencrypted private key"))?,
            fingerprint: fingerprint.join(":"),
        })
    }
}

fn file_error(path: &Path) -> impl FnOnce(io::Error) -> BridgeError {
    let path = path.to_owned();
    |source| BridgeError::File { path, source }
}

fn read(path: &Path) -> Result<Vec<u8>, BridgeError> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(LONGEST).read_to_end(&mut bytes))
        .map_err(file_error(path))?;
    Ok(bytes)
}

/// Makes a certificate with its key, in a file that only its owner may read.
fn make(path: &Path) -> Result<(), BridgeError> {
    let pem = made::made().map_err(|reason| BridgeError::Certificate {
        path: path.to_owned(),
        reason,
    })?;
    let written = || -> io::Result<()> {
        if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder)?;
        }
        let beside = Beside::new(path)?;
        // Create it again: another process may have opened the first file before its permissions were changed.
        std::fs::remove_file(beside.path())?;
        let mut options = File::options();
        options.write(true).create_new(true);
        #[cfg(unix)]
        {
            use std::os::unix::fs::OpenOptionsExt;
            options.mode(0o600);
        }
        options.open(beside.path())?.write_all(pem.as_bytes())?;
        beside.finish()
    };
    written().map_err(file_error(path))
}
