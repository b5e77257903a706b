//! Transport of datagrams to and from a controller.

use crate::codec::Datagram;
use crate::error::FriError;
use std::io::{self, ErrorKind};
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

/// The connection between a client and a controller, with its clock.
///
/// [`UdpTransport`] is the real one; [`InProcess`](crate::controller::InProcess) connects to a simulated controller, in simulated time.
pub trait Transport {
    /// Receives the next datagram into `datagram`; returns its length and sender. Waits for at most `wait`, or not at all without it; `None`: no
    /// datagram.
    ///
    /// # Errors
    /// A network error.
    fn receive(
        &mut self,
        datagram: &mut Datagram,
        wait: Option<Duration>,
    ) -> io::Result<Option<(usize, SocketAddr)>>;

    /// Sends a datagram.
    ///
    /// # Errors
    /// A network error.
    fn send(&mut self, datagram: &[u8], to: SocketAddr) -> io::Result<()>;

    /// Time since the transport was created.
    fn elapsed(&self) -> Duration;
}

/// A UDP socket and the system's clock.
#[derive(Debug)]
pub struct UdpTransport {
    socket: UdpSocket,
    start: Instant,
    /// Is the socket in blocking mode?
    blocks: bool,
}

impl UdpTransport {
    pub(super) fn bind(listen: SocketAddr) -> Result<Self, FriError> {
        let socket = UdpSocket::bind(listen).map_err(FriError::io("binding the client"))?;
        Ok(Self {
            socket,
            start: Instant::now(),
            blocks: true,
        })
    }

    pub(super) fn local_address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }
}

impl Transport for UdpTransport {
    fn receive(
        &mut self,
        datagram: &mut Datagram,
        wait: Option<Duration>,
    ) -> io::Result<Option<(usize, SocketAddr)>> {
        if self.blocks != wait.is_some() {
            self.blocks = wait.is_some();
            self.socket.set_nonblocking(!self.blocks)?;
        }
        if let Some(wait) = wait {
            if wait.is_zero() {
                return Ok(None);
            }
            self.socket.set_read_timeout(Some(wait))?;
        }
        loop {
            match self.socket.recv_from(datagram) {
                Ok(received) => return Ok(Some(received)),
                Err(error) => match error.kind() {
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => {
                        return Ok(None);
                    }
                    // Caused by an answer to a controller that is gone; reported once for each.
                    ErrorKind::ConnectionRefused | ErrorKind::ConnectionReset => {}
                    _ => return Err(error),
                },
            }
        }
    }

    fn send(&mut self, datagram: &[u8], to: SocketAddr) -> io::Result<()> {
        self.socket.send_to(datagram, to).map(|_| ())
    }

    fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }
}
