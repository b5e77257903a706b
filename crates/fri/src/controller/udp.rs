//! The simulated controller on a socket, in real time.

use super::link::{Link, LinkConfig};
use super::machine::Controller;
use super::plant::SimulatedPlant;
use crate::codec::{DATAGRAM_BYTES, Datagram};
use crate::error::{ControllerError, FriError};
use std::fmt;
use std::io::ErrorKind;
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};
use std::thread;
use std::time::{Duration, Instant};

/// Final messages of a session, which report `IDLE`.
const GOODBYES: usize = 3;

/// Network statistics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct UdpStatistics {
    /// Datagrams from other senders than the client.
    pub foreign: u64,
    /// Datagrams that could not be sent: there is no listener, or the system's buffer is full.
    pub unsent: u64,
    /// Periods that began late by more than half a period.
    pub delayed_periods: u64,
    /// Total delay of those periods, us: the controller's time fell behind by it.
    pub slipped_us: u64,
}

impl fmt::Display for UdpStatistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} periods began late, by {:.1} ms in all; {} datagrams not sent, {} from others",
            self.delayed_periods,
            self.slipped_us as f64 * 1e-3,
            self.unsent,
            self.foreign
        )
    }
}

/// A [`Controller`] that sends to a client over UDP, once per send period, and receives its answers.
///
/// Without real-time priority some periods begin late. They are counted, and the controller's time falls behind by as much: the client is not blamed
/// for delays on this side.
#[derive(Debug)]
pub struct UdpController<P> {
    controller: Controller<P>,
    socket: UdpSocket,
    client: SocketAddr,
    out: Link,
    back: Link,
    statistics: UdpStatistics,
}

impl<P: SimulatedPlant> UdpController<P> {
    /// A controller that sends from `local` (port 0: any) to `client`. The link loses datagrams in both directions, and delays those to the client.
    ///
    /// # Errors
    /// A socket that cannot be opened, or a setting of the link outside its range.
    pub fn bind(
        controller: Controller<P>,
        local: impl ToSocketAddrs,
        client: SocketAddr,
        link: LinkConfig,
    ) -> Result<Self, FriError> {
        let socket = UdpSocket::bind(local).map_err(FriError::io("binding the controller"))?;
        socket
            .set_nonblocking(true)
            .map_err(FriError::io("setting up the socket"))?;
        let back = LinkConfig {
            delay_s: 0.0,
            jitter_s: 0.0,
            seed: link.seed.wrapping_add(1),
            ..link
        };
        Ok(Self {
            controller,
            socket,
            client,
            out: Link::new(link)?,
            back: Link::new(back)?,
            statistics: UdpStatistics::default(),
        })
    }

    /// Runs until `goes_on`, called once per period, returns false. Then closes the session and delivers the datagrams in transit.
    ///
    /// # Errors
    /// An error of the simulated arm or of the network.
    pub fn run(
        &mut self,
        mut goes_on: impl FnMut(&mut Controller<P>) -> bool,
    ) -> Result<(), ControllerError<P::Error>> {
        let period = Duration::from_millis(self.controller.config().send_period_ms.into());
        let start = Instant::now();
        let mut next = start;
        loop {
            self.wait_until(next, start)?;
            let now = Instant::now();
            let late = now.saturating_duration_since(next);
            // A burst of messages could not be answered in time: a delay shifts all later periods.
            if late > period / 2 {
                self.statistics.delayed_periods += 1;
                self.statistics.slipped_us += late.as_micros() as u64;
                next = now;
            }
            next += period;
            self.cycle(start)?;
            if !goes_on(&mut self.controller) {
                break;
            }
        }
        self.controller.close()?;
        for _ in 0..GOODBYES {
            self.cycle(start)?;
        }
        // A slow network delivers them later.
        while let Some(due_s) = self.out.next_s() {
            let due = start + Duration::from_secs_f64(due_s);
            thread::sleep(due.saturating_duration_since(Instant::now()));
            self.send_due(start)?;
        }
        Ok(())
    }

    fn cycle(&mut self, start: Instant) -> Result<(), ControllerError<P::Error>> {
        self.receive(start)?;
        let mut datagram = [0; DATAGRAM_BYTES];
        let length = self.controller.cycle(&mut datagram)?;
        let now_s = start.elapsed().as_secs_f64();
        self.out.offer(now_s, datagram.get(..length).unwrap_or(&[]));
        Ok(self.send_due(start)?)
    }

    /// Receives all datagrams that the client has sent.
    fn receive(&mut self, start: Instant) -> Result<(), FriError> {
        let mut datagram: Datagram = [0; DATAGRAM_BYTES];
        loop {
            match self.socket.recv_from(&mut datagram) {
                Ok((length, from)) if from.ip() == self.client.ip() => {
                    let now_s = start.elapsed().as_secs_f64();
                    self.back
                        .offer(now_s, datagram.get(..length).unwrap_or(&[]));
                }
                Ok(_) => self.statistics.foreign += 1,
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                // Caused by an earlier datagram to a port without a listener.
                Err(error) if is_passing(error.kind()) => {}
                Err(error) => return Err(FriError::io("receiving from the client")(error)),
            }
        }
        while let Some(length) = self.back.take(start.elapsed().as_secs_f64(), &mut datagram) {
            self.controller
                .receive(datagram.get(..length).unwrap_or(&[]));
        }
        Ok(())
    }

    fn send_due(&mut self, start: Instant) -> Result<(), FriError> {
        let mut datagram: Datagram = [0; DATAGRAM_BYTES];
        while let Some(length) = self.out.take(start.elapsed().as_secs_f64(), &mut datagram) {
            let bytes = datagram.get(..length).unwrap_or(&[]);
            match self.socket.send_to(bytes, self.client) {
                Ok(_) => {}
                Err(error) if is_passing(error.kind()) => self.statistics.unsent += 1,
                Err(error) => return Err(FriError::io("sending to the client")(error)),
            }
        }
        Ok(())
    }

    /// Sleeps until `next`, and sends delayed datagrams meanwhile.
    fn wait_until(&mut self, next: Instant, start: Instant) -> Result<(), FriError> {
        loop {
            self.send_due(start)?;
            let due = self.out.next_s().map(Duration::from_secs_f64);
            let wake = due.map_or(next, |after| next.min(start + after));
            let left = wake.saturating_duration_since(Instant::now());
            if left.is_zero() && wake == next {
                return Ok(());
            }
            thread::sleep(left);
        }
    }

    /// The address that the controller sends from.
    ///
    /// # Errors
    /// A system error.
    pub fn local_address(&self) -> Result<SocketAddr, FriError> {
        self.socket
            .local_addr()
            .map_err(FriError::io("asking for the address"))
    }

    /// The network statistics.
    #[must_use]
    pub const fn udp_statistics(&self) -> &UdpStatistics {
        &self.statistics
    }

    /// The controller, for taking its events or pushing its arm.
    pub const fn controller_mut(&mut self) -> &mut Controller<P> {
        &mut self.controller
    }

    /// The controller.
    #[must_use]
    pub const fn controller(&self) -> &Controller<P> {
        &self.controller
    }
}

/// Errors that may be gone at the next datagram.
const fn is_passing(kind: ErrorKind) -> bool {
    matches!(
        kind,
        ErrorKind::ConnectionRefused
            | ErrorKind::ConnectionReset
            | ErrorKind::WouldBlock
            | ErrorKind::Interrupted
    )
}
