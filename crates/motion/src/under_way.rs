//! Progress of a motion.

use crate::joint_state::JointState;
use hwall_kinematics::JointPositions;

/// The current kind of motion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum Course {
    #[default]
    Rest,
    /// Along the last planned trajectory.
    Planned,
    /// Each joint on its own, to the goal or to rest.
    Alone { from: JointState, duration_s: f64 },
}

/// Snapshot of a motion in progress, for a planner on another thread: see [`ReferenceMotion::follow`](crate::ReferenceMotion::follow).
#[derive(Debug, Clone, Copy, Default)]
pub struct UnderWay {
    pub(crate) state: JointState,
    pub(crate) course: Course,
    /// Time since the current motion was planned, s.
    pub(crate) elapsed_s: f64,
    /// Time scale of the planned trajectory, 0 to 1.
    pub(crate) time_scale: f64,
    pub(crate) speed_share: f64,
    /// The speed share that the current motion was planned with.
    pub(crate) planned_share: f64,
    pub(crate) goal: Option<JointPositions>,
    /// A configuration that the motion still has to pass.
    pub(crate) by_way_of: Option<JointPositions>,
    /// The number of the current plan, see [`MotionPlan`](crate::MotionPlan).
    pub(crate) plan: u64,
}

impl UnderWay {
    /// The current state.
    #[must_use]
    pub const fn state(&self) -> &JointState {
        &self.state
    }

    /// The number of the plan that began the motion, 0 for none.
    #[must_use]
    pub const fn plan(&self) -> u64 {
        self.plan
    }
}
