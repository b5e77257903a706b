//! Inputs and outputs of the supervisor in a cycle.

use super::limits::person::PersonPoint;
use super::state::{SafeRequest, SafeState};
use crate::arm::{ArmCommand, ArmState};
use glam::DVec3;
use hwall_geometry::Wrench;
use hwall_kinematics::{JointPositions, JointTorques};

/// All inputs of the supervisor in a cycle.
#[derive(Debug, Clone, Copy)]
pub struct SupervisorInput<'a> {
    /// Now, s.
    pub now_s: f64,
    /// The arm's state.
    pub state: &'a ArmState,
    /// The known points of the person, base frame. A part that was seen once must keep coming, until
    /// [`Supervisor::forget`](super::Supervisor::forget).
    pub person: &'a [PersonPoint],
    /// The target of the board, base frame (m), and its time stamp (s); `None`: no target.
    pub target: Option<(DVec3, f64)>,
    /// Estimated wrench on the board about the centre of its face, base axes; `None` without torque sensors.
    pub force: Option<Wrench>,
    /// The command about to be sent.
    pub command: ArmCommand,
}

/// The output of the supervisor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupervisorStep {
    /// The command to send instead.
    pub command: ArmCommand,
    /// The current state and its reason.
    pub state: SafeState,
    /// What the renderer is asked to do next.
    pub request: SafeRequest,
    /// Is the fault latched? Then [`Supervisor::reset`](super::Supervisor::reset) is needed.
    pub latched: bool,
}

/// What was sent last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Sent {
    Nothing,
    Position(JointPositions),
    Torque(JointTorques),
}
