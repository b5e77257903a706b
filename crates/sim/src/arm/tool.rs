//! The tool of a simulated arm: pose, velocity and external wrench.

use crate::error::SimError;
use hwall_kinematics::{
    ArmKinematics, JointPositions, JointTorques, JointVelocities, Pose, Twist, Wrench,
};
use hwall_numeric::check::all_finite;
use std::sync::Arc;

/// The tool at the end of an arm, under a wrench from outside.
#[derive(Debug)]
pub(super) struct Tool {
    pub(super) arm: Arc<dyn ArmKinematics>,
    wrench: Wrench,
}

impl Tool {
    /// A tool without a wrench.
    pub(super) fn new(arm: Arc<dyn ArmKinematics>) -> Self {
        Self {
            arm,
            wrench: Wrench::default(),
        }
    }

    /// Sets the wrench, base axes, about the tool origin; it stays until set again.
    pub(super) fn push(&mut self, wrench: Wrench) -> Result<(), SimError> {
        all_finite("wrench", &wrench.to_array())?;
        self.wrench = wrench;
        Ok(())
    }

    pub(super) fn pose(&self, q: &JointPositions) -> Pose {
        self.arm.forward(q)
    }

    /// Base axes, at the tool origin.
    pub(super) fn twist(&self, q: &JointPositions, qd: &JointVelocities) -> Twist {
        self.arm.jacobian(q).twist(qd)
    }

    /// Joint torques of the wrench, N m.
    pub(super) fn torques(&self, q: &JointPositions) -> JointTorques {
        self.arm.jacobian(q).torques(&self.wrench)
    }
}
