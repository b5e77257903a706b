//! The simulated arms of `hwall-sim` behind the controller.

use super::plant::SimulatedPlant;
use hwall_kinematics::{ArmKinematics, JointTorques};
use hwall_sim::{ServoArm, SimError, TorqueArm};
use std::sync::Arc;

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
