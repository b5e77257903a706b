//! The simulated arms of `hwall-sim` as plants of the controller.

use super::plant::SimulatedPlant;
use hwall_kinematics::{ArmKinematics, JointPositions, JointTorques, SrsArm};
use hwall_sim::kinematics::{Chain, ChainDynamics};
use hwall_sim::{ServoArm, ServoConfig, SimError, TorqueArm, TorqueConfig};
use std::sync::Arc;

/// Start configuration of the reference setup's iiwa, degrees.
const START_DEG: [f64; 7] = [0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0];

/// An iiwa 7 at servo level with its bare flange, at rest at (0, 30, 0, -90, 0, -30, 90) degrees.
///
/// # Errors
/// None: the settings are valid.
pub fn iiwa7_servo(seed: u64) -> Result<ServoArm, SimError> {
    let config = ServoConfig {
        seed,
        ..ServoConfig::default()
    };
    let start = JointPositions::from_deg(START_DEG);
    ServoArm::new(Arc::new(SrsArm::iiwa7()), start, config)
}

/// The same at torque level, without a command delay: the interface's delay is the send period.
///
/// # Errors
/// None: the settings are valid.
pub fn iiwa7_torque(seed: u64) -> Result<TorqueArm, SimError> {
    let config = TorqueConfig {
        seed,
        command_delay_s: 0.0,
        ..TorqueConfig::default()
    };
    let dynamics = ChainDynamics::new(&Chain::iiwa7())?;
    let start = JointPositions::from_deg(START_DEG);
    TorqueArm::new(Arc::new(SrsArm::iiwa7()), dynamics, start, config)
}

impl SimulatedPlant for ServoArm {
    fn advance(&mut self, dt_s: f64) -> Result<(), SimError> {
        Self::advance(self, dt_s)
    }

    fn model(&self) -> &Arc<dyn ArmKinematics> {
        Self::model(self)
    }

    fn takes_torques(&self) -> bool {
        false
    }
}

/// The impedance of the modes torque and wrench runs within the controller, so an arm for them should have a
/// [`command_delay_s`](hwall_sim::TorqueConfig::command_delay_s) of 0: the interface's own delay is the send period.
impl SimulatedPlant for TorqueArm {
    fn advance(&mut self, dt_s: f64) -> Result<(), SimError> {
        Self::advance(self, dt_s)
    }

    fn model(&self) -> &Arc<dyn ArmKinematics> {
        Self::model(self)
    }

    fn takes_torques(&self) -> bool {
        true
    }

    fn measured_torque(&self) -> JointTorques {
        self.motor_torque()
    }
}
