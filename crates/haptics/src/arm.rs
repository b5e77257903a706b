//! The interface between the renderer and an arm, simulated or real.

use crate::HapticsError;
use hwall_kinematics::{JointPositions, JointTorques, JointVelocities};

/// What an arm reports at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmState {
    /// Time of the measurement on the arm's clock, s.
    pub t_s: f64,
    /// Measured joint angles, rad.
    pub q: JointPositions,
    /// Measured joint velocities, rad/s.
    pub qd: JointVelocities,
    /// External joint torques that gravity and motion do not explain, N m. `None` for an arm without torque sensors.
    pub external_torque: Option<JointTorques>,
}

impl ArmState {
    /// Rejects NaN and infinities, naming the quantity and the joint.
    ///
    /// # Errors
    /// The first value that is not finite.
    pub fn validate(&self) -> Result<(), HapticsError> {
        let check =
            |what: &'static str, values: &[f64]| match values.iter().position(|v| !v.is_finite()) {
                None => Ok(()),
                Some(joint) => Err(HapticsError::NonFiniteState {
                    what,
                    joint,
                    value: values[joint],
                }),
            };
        check("t_s", &[self.t_s])?;
        check("q", &self.q.0)?;
        check("qd", &self.qd.0)?;
        self.external_torque
            .map_or(Ok(()), |torque| check("external_torque", &torque.0))
    }
}

/// The command for the coming cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ArmCommand {
    /// Joint angles for the arm's own servo to track, rad.
    Position(JointPositions),
    /// Torques added to gravity compensation, N m: an overlay on a compliant arm. The arm itself compensates gravity, and friction as far as it knows
    /// it.
    Torque(JointTorques),
    /// Brake to rest as fast as the arm may, and stay there.
    Hold,
}

/// A cyclic arm: each control period reads its state and writes one command.
///
/// The simulated arm of `hwall-sim` implements it; a driver for a real arm does the same over its command interface (a 1 kHz cyclic one such as FRI,
/// or a position interface).
pub trait Arm {
    /// The driver's own error.
    type Error: std::error::Error + Send + Sync + 'static;

    /// The newest measured state.
    ///
    /// # Errors
    /// A lost connection or a state that could not be read.
    fn state(&mut self) -> Result<ArmState, Self::Error>;

    /// Sends the command for the coming cycle. If the arm refuses it, the last command stays in force or the arm brakes.
    ///
    /// # Errors
    /// A lost connection, NaN, or a command outside the arm's limits.
    fn command(&mut self, command: ArmCommand) -> Result<(), Self::Error>;

    /// Does this error of [`command`](Self::command) concern this cycle only? Then the arm brakes or holds, and may accept later commands. By default
    /// no error is transient.
    #[must_use]
    fn is_transient(_error: &Self::Error) -> bool {
        false
    }
}
