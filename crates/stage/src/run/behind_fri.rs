//! A servo arm behind the Fast Robot Interface, on a connection with configurable faults, in simulated time.

use super::arm_error::ArmError;
use hwall::haptics::{Arm, ArmCommand, ArmState};
use hwall_fri::controller::{Controller, ControllerConfig, FaultConfig, InProcess};
use hwall_fri::{ClientStatistics, FriClient, FriClientConfig, FriError};
use hwall_sim::ServoArm;
use std::time::Duration;

/// Commanding begins after 0.75 s of the controller's time.
const BEGINNING: Duration = Duration::from_secs(10);
/// Timeout for a cycle of the controller, which always comes.
const NEXT: Duration = Duration::from_secs(1);

/// The clock is zero when commanding begins and advances by one send period, which is the control period.
#[derive(Debug)]
pub struct FriArm {
    client: FriClient<InProcess<ServoArm>>,
    begun_s: f64,
}

impl FriArm {
    /// Wraps an arm at rest.
    ///
    /// # Errors
    /// A control period that is not 1 to 10 whole milliseconds, or faults outside their ranges.
    pub fn new(arm: ServoArm, faults: FaultConfig, period_s: f64) -> Result<Self, FriError> {
        let model = arm.model().clone();
        let config = ControllerConfig {
            send_period_ms: (1e3 * period_s).round() as u32,
            faults,
            ..ControllerConfig::default()
        };
        let way = Controller::new(arm, config).map_err(|_| FriError::NoMessage)?;
        let mut client = FriClient::over(&model, FriClientConfig::default(), InProcess::new(way))?;
        let begun_s = client.wait_for_commanding(BEGINNING)?;
        Ok(Self { client, begun_s })
    }

    /// The arm that the controller moves.
    pub(super) fn plant(&self) -> &ServoArm {
        self.client.transport().controller().plant()
    }

    pub(super) fn plant_mut(&mut self) -> &mut ServoArm {
        self.client.transport_mut().controller_mut().plant_mut()
    }

    /// Sets the faults of the connection.
    ///
    /// # Errors
    /// A setting outside its range; nothing is then changed.
    pub fn set_faults(&mut self, faults: FaultConfig) -> Result<(), FriError> {
        let controller = self.client.transport_mut().controller_mut();
        controller.set_faults(faults)
    }

    /// The next message.
    pub(super) fn advance(&mut self) -> Result<(), ArmError> {
        Ok(self.client.wait_for_message(NEXT).map(|_| ())?)
    }

    /// Acknowledges at the controller, so that it accepts commands again after a limit ended them.
    pub fn acknowledge(&mut self) {
        self.client.transport_mut().controller_mut().acknowledge();
    }

    /// Counters of the client.
    #[must_use]
    pub const fn statistics(&self) -> &ClientStatistics {
        self.client.statistics()
    }
}

impl Arm for FriArm {
    type Error = ArmError;

    fn state(&mut self) -> Result<ArmState, ArmError> {
        let state = self.client.state()?;
        Ok(ArmState {
            t_s: state.t_s - self.begun_s,
            ..state
        })
    }

    fn command(&mut self, command: ArmCommand) -> Result<(), ArmError> {
        Ok(self.client.command(command)?)
    }
}
