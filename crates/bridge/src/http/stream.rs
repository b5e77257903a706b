//! A connection, plain or encrypted.

use crate::locked::locked;
use crate::tls::{Security, Session};
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// A TCP connection, encrypted or not. Clones share it. Each write is complete, so that two threads may write.
#[derive(Clone)]
pub(crate) struct Stream(Arc<Shared>);

struct Shared {
    tcp: TcpStream,
    writing: Mutex<()>,
    tls: Option<Session>,
}

impl Stream {
    pub(crate) fn plain(tcp: TcpStream) -> Self {
        Self::new(tcp, None)
    }

    /// After the handshake, which may take this long.
    pub(crate) fn secured(
        tcp: TcpStream,
        security: &Security,
        within: Duration,
    ) -> io::Result<Self> {
        let until = Instant::now() + within;
        let stream = Self::new(tcp, Some(security.session()?));
        while stream.0.tls.as_ref().is_some_and(Session::is_handshaking) {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(io::ErrorKind::TimedOut.into());
            }
            let left = left.max(Duration::from_millis(1));
            stream.tcp().set_read_timeout(Some(left))?;
            if stream.receive()? == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
        }
        Ok(stream)
    }

    fn new(tcp: TcpStream, tls: Option<Session>) -> Self {
        Self(Arc::new(Shared {
            tcp,
            writing: Mutex::default(),
            tls,
        }))
    }

    /// The connection beneath, for its settings.
    pub(crate) fn tcp(&self) -> &TcpStream {
        &self.0.tcp
    }

    /// Announces that nothing more will be sent.
    pub(crate) fn finish(&self) -> io::Result<()> {
        if let Some(tls) = &self.0.tls {
            tls.end();
            self.send(&[])?;
        }
        self.tcp().shutdown(Shutdown::Write)
    }

    /// One read of the connection beneath; returns its bytes, 0 at the end.
    fn receive(&self) -> io::Result<usize> {
        // Together with the longest partial record, this fits into rustls's buffer of 18 kB.
        let mut sealed = [0; 1024];
        let count = self.tcp().read(&mut sealed)?;
        let Some(tls) = &self.0.tls else {
            return Ok(count);
        };
        let taken = tls.take(sealed.get(..count).unwrap_or_default());
        // Also after an error, to send the alert that names it.
        if tls.has_to_send() {
            self.send(&[])?;
        }
        taken.map(|()| count)
    }

    fn send(&self, bytes: &[u8]) -> io::Result<()> {
        // Encrypted records must leave in the order in which they were made.
        let _whole = locked(&self.0.writing);
        match &self.0.tls {
            None => self.tcp().write_all(bytes),
            Some(tls) => self.tcp().write_all(&tls.sealed(bytes)?),
        }
    }
}

impl Read for Stream {
    /// Fails with `Interrupted` after a part of a record: the caller decides how long it waits for the rest.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let Some(tls) = &self.0.tls else {
            return self.tcp().read(buffer);
        };
        if let Some(count) = tls.opened(buffer)? {
            return Ok(count);
        }
        if self.receive()? == 0 {
            return Ok(0);
        }
        let opened = tls.opened(buffer)?;
        opened.ok_or_else(|| io::ErrorKind::Interrupted.into())
    }
}

impl Write for Stream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.send(bytes)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
