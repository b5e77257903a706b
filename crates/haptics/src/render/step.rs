//! Inputs and outputs of a control step.

use super::hold::HoldReason;
use super::object::object_port::PortLedger;
use crate::arm::ArmCommand;
use crate::board::BoardTarget;
use crate::body::PersonBody;
use crate::motion::Slide;
use crate::safety::SafeRequest;
use glam::DVec3;
use hwall_geometry::Wrench;
use hwall_kinematics::{JointPositions, Unreachable};

/// What the renderer is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Phase {
    /// Following the target.
    NonContact,
    /// Touched: standing still like a wall, or sliding within its plane.
    Contact {
        /// Onset of the touch, s.
        since_s: f64,
    },
    /// Standing still because an input is missing or wrong.
    Hold(HoldReason),
}

/// The inputs of a control step besides the state of the arm.
#[derive(Debug, Clone, Copy, Default)]
pub struct RenderInput<'a> {
    /// The target of the board.
    pub target: Option<&'a BoardTarget>,
    /// The posture to wait in while there is no target.
    pub posture: Option<&'a PostureTarget>,
    /// The board's motion within its plane while it is touched; `None`: it stands still.
    pub slide: Option<&'a Slide>,
    /// The moving object that the target lies on ([`Renderer::set_objects`](super::Renderer::set_objects)); while touched, the board moves along with
    /// it. `None`: a touched board stands still, or slides.
    pub object: Option<usize>,
    /// Known points of the person, base frame, m: the board keeps clear of them and slows down near them.
    pub person_m: &'a [DVec3],
    /// The person and bystanders at their last known positions: paths keep clear of heads and torsos ([`Renderer::keep_clear`](super::Renderer::keep_clear)).
    pub body: PersonBody,
    /// The configuration in which the arm is known to be free ([`Supervisor::began`](crate::safety::Supervisor::began)): paths are then checked with
    /// the same parts of the arm as motions.
    pub began: Option<JointPositions>,
    /// The supervisor's request; `None`: continue.
    pub request: Option<SafeRequest>,
}

/// A posture for the arm while there is nothing to present.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PostureTarget {
    /// Joint angles, rad.
    pub q: JointPositions,
    /// A configuration to pre-position towards, see [`Follower::set_posture`](crate::Follower::set_posture).
    pub prepositions_to: Option<JointPositions>,
    /// When this was decided, s, on the renderer's clock; an old one counts as missing, as for a target.
    pub stamp_s: f64,
}

/// The outcome of one control step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderStep {
    /// The command for the arm.
    pub command: ArmCommand,
    /// The current phase and its reason.
    pub phase: Phase,
    /// Estimated external wrench on the face about its centre, base axes, unfiltered. `None` as for `normal_force_n`.
    pub wrench: Option<Wrench>,
    /// Filtered force pressing the board against its outward normal, N. `None` without torque sensors
    /// or while the state is unusable.
    pub normal_force_n: Option<f64>,
    /// Why the target is unreachable, if so; the board then keeps its last goal.
    pub unreachable: Option<Unreachable>,
    /// The configuration that the board is moving to, rad.
    pub goal: Option<JointPositions>,
    /// Is the touched board on the requested slide? Not if the slide is unreachable (see `unreachable`) or not finite: the board then stands still.
    pub sliding: bool,
    /// Time until the board is at its goal, s, see [`Follower::left_s`](crate::Follower::left_s); `None` without a goal.
    pub left_s: Option<f64>,
    /// Does a person occupy the place of the board? It then stays behind them.
    pub obstructed: bool,
    /// Energy exchanged between the hand and the moving object that the board is on, since the touch began; `None` without an object.
    pub object_port: Option<PortLedger>,
    /// No path behind the surfaces leads to the goal: the current motion ends, and the board stands still.
    pub blocked: bool,
}
