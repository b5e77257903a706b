//! What goes into a control step, and what comes out.

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
    /// Touched: standing still as a wall does, or sliding within its plane.
    Contact {
        /// Onset of the touch, s.
        since_s: f64,
    },
    /// Standing still because an input is missing or wrong.
    Hold(HoldReason),
}

/// What a control step is given besides the state of the arm.
#[derive(Debug, Clone, Copy, Default)]
pub struct RenderInput<'a> {
    /// Where the board shall be.
    pub target: Option<&'a BoardTarget>,
    /// Where the arm waits while there is no target.
    pub posture: Option<&'a PostureTarget>,
    /// How the board moves within its plane while it is touched; `None`: it stands still.
    pub slide: Option<&'a Slide>,
    /// Which of the moving objects the target lies on ([`Renderer::set_objects`](super::Renderer::set_objects)); while it is touched the board goes along with
    /// it. `None`: what is touched stands still, or slides.
    pub object: Option<usize>,
    /// Points of the person that are known, base frame, m: the board keeps clear of them and slows down near them.
    pub person_m: &'a [DVec3],
    /// The person as last seen: ways keep clear of head and torso ([`Renderer::keep_clear`](super::Renderer::keep_clear)).
    pub body: PersonBody,
    /// Where the arm is known to be free ([`Supervisor::began`](crate::safety::Supervisor::began)): ways are judged by the same parts of
    /// the arm as motions are.
    pub began: Option<JointPositions>,
    /// What a supervisor asks for; `None`: to go on.
    pub request: Option<SafeRequest>,
}

/// A posture of the arm while nothing is to be presented.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PostureTarget {
    /// Joint angles, rad.
    pub q: JointPositions,
    /// A configuration to lean to from there, see [`Follower::set_posture`](crate::Follower::set_posture).
    pub prepositions_to: Option<JointPositions>,
    /// When this was decided, s, on the renderer's clock; too old counts as missing, as for a target.
    pub stamp_s: f64,
}

/// The outcome of one control step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderStep {
    /// What the arm is told.
    pub command: ArmCommand,
    /// What the renderer is doing, and why.
    pub phase: Phase,
    /// Estimated wrench of the outside on the face, base axes, about its middle, unfiltered. `None` as for `normal_force_n`.
    pub wrench: Option<Wrench>,
    /// Filtered force pressing the board against its outward normal, N. `None` without torque sensors
    /// or while the state is unusable.
    pub normal_force_n: Option<f64>,
    /// Why the target cannot be reached, if it cannot; the board then keeps its last goal.
    pub unreachable: Option<Unreachable>,
    /// The configuration that the board is on its way to, rad.
    pub goal: Option<JointPositions>,
    /// Is the touched board on the slide that was asked for? Not if it cannot be reached (see
    /// `unreachable`) or is not finite: the board then stands still.
    pub sliding: bool,
    /// Time until the board is at its goal, s, see [`Follower::left_s`](crate::Follower::left_s); `None` without a goal.
    pub left_s: Option<f64>,
    /// Is a person where the board would have to be? It then stays behind them.
    pub obstructed: bool,
    /// The energy between the hand and the moving object that the board is on, since the touch began; `None` without one.
    pub object_port: Option<PortLedger>,
    /// No way leads to the goal behind the surfaces: the motion under way ends, and the board stands.
    pub blocked: bool,
}
