//! The simulated arm that the controller moves.

use hwall_haptics::Arm;
use hwall_kinematics::{ArmKinematics, JointTorques};
use std::sync::Arc;

/// A simulated arm for a [`Controller`](super::Controller): an [`Arm`] with its own clock.
///
/// With the feature `sim` the arms of `hwall-sim` implement it.
pub trait SimulatedPlant: Arm {
    /// Advances the clock.
    ///
    /// # Errors
    /// A motion that cannot be computed.
    fn advance(&mut self, dt_s: f64) -> Result<(), Self::Error>;

    /// Its kinematics, including joint limits.
    fn model(&self) -> &Arc<dyn ArmKinematics>;

    /// Does it accept torques? The modes torque and wrench need them.
    fn takes_torques(&self) -> bool;

    /// Readings of the joint torque sensors, N m; zero for an arm without them.
    fn measured_torque(&self) -> JointTorques {
        JointTorques([0.0; 7])
    }
}
