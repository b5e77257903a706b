//! How datagrams get to a controller and back.

use crate::codec::Datagram;
use crate::error::FriError;
use std::io::{self, ErrorKind};
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

/// The way between a client and a controller, and the time on it.
///
/// [`UdpTransport`] is the real one; [`InProcess`](crate::controller::InProcess) has a simulated controller at its end, in a
/// time of its own.
pub trait Transport {
    /// The next datagram: its bytes go into `datagram`; their number and where they came from are returned. Waits for at most
    /// `wait`, not at all without it; `None`: nothing came.
    ///
    /// # Errors
    /// What the network says.
    fn receive(
        &mut self,
        datagram: &mut Datagram,
        wait: Option<Duration>,
    ) -> io::Result<Option<(usize, SocketAddr)>>;

    /// Sends a datagram.
    ///
    /// # Errors
    /// What the network says.
    fn send(&mut self, datagram: &[u8], to: SocketAddr) -> io::Result<()>;

    /// Time since the transport was made.
    fn elapsed(&self) -> Duration;
}

/// A UDP socket and the system's clock.
#[derive(Debug)]
pub struct UdpTransport {
    socket: UdpSocket,
    start: Instant,
    /// Does the socket wait now?
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
                    // Of an answer to a controller that is gone; each is said once.
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
