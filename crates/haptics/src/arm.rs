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
    /// Joint torques that gravity and motion do not explain, N m: what the outside exerts on the
    /// arm. `None` for an arm without torque sensors.
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

/// What an arm is told for the coming cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ArmCommand {
    /// Be at these joint angles, rad; the arm's own servo tracks them.
    Position(JointPositions),
    /// Torques beyond those that hold the arm against gravity, N m: an overlay on a compliant arm. The arm itself compensates
    /// gravity, and friction as far as it knows it.
    Torque(JointTorques),
    /// Stay where you are: brake to rest as fast as the arm may.
    Hold,
}

/// A cyclic arm: its state is read and a command is written once in every control period.
///
/// The simulated arm of `hwall-sim` implements it, and a driver for a real one does the same over
/// its command interface (a 1 kHz cyclic one such as FRI, or a position interface).
pub trait Arm {
    /// The driver's own error.
    type Error: std::error::Error + Send + Sync + 'static;

    /// The newest measured state.
    ///
    /// # Errors
    /// A lost connection or a state that could not be read.
    fn state(&mut self) -> Result<ArmState, Self::Error>;

    /// Sends the command for the coming cycle. Instead of a refused command the last one stays in force, or the arm brakes.
    ///
    /// # Errors
    /// A lost connection, NaN, or a command outside the arm's limits.
    fn command(&mut self, command: ArmCommand) -> Result<(), Self::Error>;

    /// Does this error of [`command`](Self::command) concern this cycle only? The arm brakes or holds, and commands may be taken again
    /// later. By default none does.
    #[must_use]
    fn is_transient(_error: &Self::Error) -> bool {
        false
    }
}
