//! A simulated controller connected by function calls.

use super::machine::Controller;
use super::plant::SimulatedPlant;
use crate::client::Transport;
use crate::codec::Datagram;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::time::Duration;

/// The address that the controller reports.
const ADDRESS: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 30200);

/// A simulated controller in the same program: no socket, no clock, no thread.
///
/// One send period passes whenever the client waits for a message. The same commands give bit-identical states, as fast as they can be computed: for
/// tests of whole programs.
///
/// ```
/// use hwall_fri::controller::{Controller, ControllerConfig, InProcess, iiwa7_servo};
/// use hwall_fri::{FriClient, FriClientConfig};
/// use hwall_haptics::{Arm, ArmCommand};
/// use std::{sync::Arc, time::Duration};
///
/// let plant = iiwa7_servo(1)?;
/// let model = Arc::clone(plant.model());
/// let controller = Controller::new(plant, ControllerConfig::default())?;
/// let mut arm = FriClient::over(&model, FriClientConfig::default(), InProcess::new(controller))?;
/// arm.wait_for_commanding(Duration::from_secs(60))?;
/// let mut goal = arm.state()?.q;
/// let start_rad = goal.0[6];
/// for _ in 0..1000 {
///     goal.0[6] += 1e-4;
///     arm.command(ArmCommand::Position(goal))?;
///     arm.wait_for_message(Duration::from_secs(1))?;
/// }
/// assert!(arm.state()?.q.0[6] > start_rad + 0.09);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct InProcess<P> {
    controller: Controller<P>,
}

impl<P> InProcess<P> {
    /// A connection to this controller.
    #[must_use]
    pub const fn new(controller: Controller<P>) -> Self {
        Self { controller }
    }

    /// The controller.
    #[must_use]
    pub const fn controller(&self) -> &Controller<P> {
        &self.controller
    }

    /// The controller, for taking its events or pushing its arm.
    pub const fn controller_mut(&mut self) -> &mut Controller<P> {
        &mut self.controller
    }
}

impl<P: SimulatedPlant> Transport for InProcess<P> {
    fn receive(
        &mut self,
        datagram: &mut Datagram,
        wait: Option<Duration>,
    ) -> io::Result<Option<(usize, SocketAddr)>> {
        if wait.is_none_or(|wait| wait.is_zero()) {
            return Ok(None);
        }
        let cycle = self.controller.cycle(datagram).map_err(io::Error::other)?;
        Ok(Some((cycle, ADDRESS)))
    }

    fn send(&mut self, datagram: &[u8], _: SocketAddr) -> io::Result<()> {
        self.controller.receive(datagram);
        Ok(())
    }

    fn elapsed(&self) -> Duration {
        Duration::try_from_secs_f64(self.controller.t_s()).unwrap_or_default()
    }
}
