//! What the simulated controller moves.

use hwall_haptics::Arm;
use hwall_kinematics::{ArmKinematics, JointTorques};
use std::sync::Arc;

/// A simulated arm that a [`Controller`](super::Controller) moves: an [`Arm`] with a clock of its own.
///
/// With the feature `sim` the arms of `hwall-sim` are such.
pub trait SimulatedPlant: Arm {
    /// Moves the clock on.
    ///
    /// # Errors
    /// A motion that cannot be computed.
    fn advance(&mut self, dt_s: f64) -> Result<(), Self::Error>;

    /// Its kinematics, with the limits of the joints.
    fn model(&self) -> &Arc<dyn ArmKinematics>;

    /// Does it take torques? The modes torque and wrench need that.
    fn takes_torques(&self) -> bool;

    /// What the torque sensors of the joints read, N m; zero for an arm that knows no torques.
    fn measured_torque(&self) -> JointTorques {
        JointTorques([0.0; 7])
    }
}
