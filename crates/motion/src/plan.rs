//! Motions that are planned on one thread and made on another.

use crate::reference::{NEW, ReferenceMotion};
use crate::solver::Way;
use crate::under_way::{Course, UnderWay};
use hwall_kinematics::JointPositions;

/// A planned motion on its way from a planner to the one that makes it: it begins where the motion under way will be.
#[derive(Clone)]
pub struct MotionPlan {
    number: u64,
    way: Way,
    goal: JointPositions,
    by_way_of: Option<JointPositions>,
    planned_share: f64,
    /// Each joint by itself: the solver found nothing.
    is_alone: bool,
    /// Where it begins, on the motion before it.
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
    /// Room for a plan.
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

    /// Numbers rise by one with every plan of a planner.
    #[must_use]
    pub const fn number(&self) -> u64 {
        self.number
    }
}

/// A state this near to the one that a plan begins from is that one, rad, rad/s and rad/s².
const SAME_STATE: [f64; 3] = [1e-9, 1e-6, 1e-3];

impl ReferenceMotion {
    /// Where the motion is on its way.
    #[must_use]
    pub const fn under_way(&self) -> UnderWay {
        self.now
    }

    /// A planner's copy goes on as the motion that is made does, and so many steps of `dt_s` further. The copy has the trajectory: its
    /// last plan is in force there, or, if that was not taken, the one before.
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

    /// Was a motion begun here since [`follow`](Self::follow)?
    #[must_use]
    pub const fn is_begun(&self) -> bool {
        self.now.plan == NEW
    }

    /// Copies the motion that has just been begun here for the one that makes it. `begins`: where it begins, before it was begun.
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

    /// How long until a plan begins, s; `None` if the motion does not come to where it begins.
    #[must_use]
    pub fn begins_in_s(&self, plan: &MotionPlan) -> Option<f64> {
        if self.now.state.is_near(&plan.begins.state, SAME_STATE) {
            return Some(0.0);
        }
        let is_ahead = self.now.course != Course::Rest && plan.begins.plan == self.now.plan;
        let left_s = (plan.begins.elapsed_s - self.now.elapsed_s) / self.now.pace;
        (is_ahead && left_s > 0.0).then_some(left_s)
    }

    /// Begins a plan if the state is the one that it begins from. Was it? What was in force is in the plan then.
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
            (self.now.course, self.now.elapsed_s, self.now.pace) = (Course::Planned, 0.0, 1.0);
        }
        self.now.plan = plan.number;
        true
    }
}
