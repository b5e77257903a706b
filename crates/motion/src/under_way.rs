//! How far a motion has come.

use crate::joint_state::JointState;
use hwall_kinematics::JointPositions;

/// How the joints move at present.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum Course {
    #[default]
    Rest,
    /// Along the trajectory that was planned last.
    Planned,
    /// Each joint by itself, to the goal or to rest.
    Alone { from: JointState, duration_s: f64 },
}

/// Where a motion is on its way, for a planner on another thread: see
/// [`ReferenceMotion::follow`](crate::ReferenceMotion::follow).
#[derive(Debug, Clone, Copy, Default)]
pub struct UnderWay {
    pub(crate) state: JointState,
    pub(crate) course: Course,
    /// Since the motion in force was planned.
    pub(crate) elapsed_s: f64,
    /// How fast time passes on the planned trajectory, 0 to 1.
    pub(crate) pace: f64,
    pub(crate) speed_share: f64,
    /// The share that the motion in force was planned with.
    pub(crate) planned_share: f64,
    pub(crate) goal: Option<JointPositions>,
    /// A configuration to pass on the way, while it lies ahead.
    pub(crate) by_way_of: Option<JointPositions>,
    /// The number of the plan in force, see [`MotionPlan`](crate::MotionPlan).
    pub(crate) plan: u64,
}

impl UnderWay {
    /// The state there.
    #[must_use]
    pub const fn state(&self) -> &JointState {
        &self.state
    }

    /// The number of the plan that the motion was begun with, 0 for none.
    #[must_use]
    pub const fn plan(&self) -> u64 {
        self.plan
    }
}
