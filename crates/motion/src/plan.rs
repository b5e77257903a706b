//! Motions planned on one thread and executed on another.

use crate::reference::{NEW, ReferenceMotion};
use crate::solver::Way;
use crate::under_way::{Course, UnderWay};
use hwall_kinematics::JointPositions;

/// A planned motion in transit from the planner to the executor: it begins at a future point of the current motion.
#[derive(Clone)]
pub struct MotionPlan {
    number: u64,
    way: Way,
    goal: JointPositions,
    by_way_of: Option<JointPositions>,
    planned_share: f64,
    /// The solver found no motion: each joint moves on its own.
    is_alone: bool,
    /// Where the plan begins on the previous motion.
    begins: UnderWay,
}

impl std::fmt::Debug for MotionPlan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MotionPlan")
            .field("number", &self.number)
            .field("from", &self.begins.state)
            .field("goal", &self.goal)
            .finish_non_exhaustive()
    }
}

impl MotionPlan {
    /// Reserves memory for a plan.
    #[must_use]
    pub fn reserved() -> Self {
        Self {
            number: 0,
            way: Way::reserved(),
            goal: JointPositions::default(),
            by_way_of: None,
            planned_share: 1.0,
            is_alone: false,
            begins: UnderWay::default(),
        }
    }

    /// The number of the plan; it increases by one with every plan of a planner.
    #[must_use]
    pub const fn number(&self) -> u64 {
        self.number
    }
}

/// A state this close to the beginning of a plan counts as equal, rad, rad/s and rad/s².
const SAME_STATE: [f64; 3] = [1e-9, 1e-6, 1e-3];

impl ReferenceMotion {
    /// A snapshot of the current motion.
    #[must_use]
    pub const fn under_way(&self) -> UnderWay {
        self.now
    }

    /// Sets a planner's copy to the executed motion, and advances it by `steps` of `dt_s`. The copy already contains the trajectory, because the
    /// executor runs the copy's last plan or, if that was not taken, the one before.
    pub fn follow(&mut self, under_way: &UnderWay, steps: u32, dt_s: f64) {
        if under_way.course == Course::Planned && under_way.plan != self.now.plan {
            std::mem::swap(&mut self.way, &mut self.next);
        }
        self.considered = None;
        self.now = *under_way;
        for _ in 0..steps {
            // A step of finite length cannot fail.
            let _ = self.step(dt_s);
        }
    }

    /// Has a motion begun on this copy since [`follow`](Self::follow)?
    #[must_use]
    pub const fn is_begun(&self) -> bool {
        self.now.plan == NEW
    }

    /// Copies the motion that has just begun on this copy, for the executor. `begins`: the snapshot from before it began.
    pub fn offer(&mut self, begins: &UnderWay, number: u64, plan: &mut MotionPlan) {
        self.now.plan = number;
        plan.number = number;
        plan.is_alone = self.now.course != Course::Planned;
        if !plan.is_alone {
            plan.way.clone_from(&self.way);
        }
        plan.goal = self.now.goal.unwrap_or(self.now.state.q);
        (plan.by_way_of, plan.planned_share) = (self.now.by_way_of, self.now.planned_share);
        plan.begins = *begins;
    }

    /// Time until a plan begins, s; `None` if the current motion does not reach its beginning.
    #[must_use]
    pub fn begins_in_s(&self, plan: &MotionPlan) -> Option<f64> {
        if self.now.state.is_near(&plan.begins.state, SAME_STATE) {
            return Some(0.0);
        }
        let is_ahead = self.now.course != Course::Rest && plan.begins.plan == self.now.plan;
        let left_s = (plan.begins.elapsed_s - self.now.elapsed_s) / self.now.time_scale;
        (is_ahead && left_s > 0.0).then_some(left_s)
    }

    /// Begins a plan if the state matches its beginning. Returns whether it did; `plan` then contains the previous motion.
    pub fn take(&mut self, plan: &mut MotionPlan) -> bool {
        if !self.now.state.is_near(&plan.begins.state, SAME_STATE) {
            return false;
        }
        (self.now.goal, self.now.by_way_of) = (Some(plan.goal), plan.by_way_of);
        (self.now.planned_share, self.considered) = (plan.planned_share, None);
        if plan.is_alone {
            self.now.planned_share = self.now.speed_share;
            self.go_alone(|joint, bounds, i| joint.time_to_s(plan.goal[i], bounds));
        } else {
            std::mem::swap(&mut self.way, &mut plan.way);
            (self.now.course, self.now.elapsed_s, self.now.time_scale) =
                (Course::Planned, 0.0, 1.0);
        }
        self.now.plan = plan.number;
        true
    }
}
