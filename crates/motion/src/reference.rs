//! The motion that the arm is told to make.

use crate::error::MotionError;
use crate::joint::{JointBounds, JointPoint};
use crate::joint_state::JointState;
use crate::limits::MotionLimits;
use hwall_kinematics::{ArmKinematics, JointPositions, MOST_JOINTS};
use hwall_numeric::check::{all_finite, non_negative, that};
use rsruckig::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// By how much the rounding of a plan may leave a joint limit, rad.
const ROUNDING_RAD: f64 = 1e-9;

/// How near to the largest speed a state counts as on its edge, as a share of it.
const SPEED_EDGE: f64 = 1e-9;

/// How the joints share the time of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum JointTiming {
    /// All arrive at the same time, that of the slowest.
    #[default]
    Together,
    /// As [`Together`](Self::Together), and on a straight line between configurations where the start allows it.
    Straight,
    /// Each as soon as it can.
    Soonest,
}

/// A motion that was planned and is not in force.
#[derive(Debug, Clone, Copy)]
struct Considered {
    goal: JointPositions,
    by_way_of: Option<JointPositions>,
}

/// How the joints move at present.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Course {
    #[default]
    Rest,
    /// Along the trajectory that was planned last.
    Planned,
    /// Each joint by itself, to the goal or to rest.
    Alone { from: JointState, duration_s: f64 },
}

/// A jerk-limited, time-optimal motion of all joints to a goal at rest, which may be replaced at any time.
///
/// Planned once for each goal, then only evaluated. The limits of speed, acceleration, jerk and position are kept from any
/// state from which they can be; a state beyond a limit is first brought back within it. Braking and the rare states for
/// which the solver finds nothing (about one in 250,000) are left to each joint by itself,
/// [`JointPoint`], which always finds a motion.
///
/// Nothing is allocated after construction, but for the message of a failure of the solver. Planning:
/// [Berscheid and Kröger 2021], by the crate `rsruckig`. Error: at its end a plan is up to 1e-8 rad off the
/// goal, which is then set exactly; durations are the least of the slowest joint to 1e-9 s (tests/it/reference.rs).
/// From speeds above the limit, after a smaller share was set, they are up to 20 ms longer: it slows down first.
#[derive(Clone)]
pub struct ReferenceMotion {
    otg: Ruckig<MOST_JOINTS, ThrowErrorHandler>,
    input: InputParameter<MOST_JOINTS>,
    trajectory: Trajectory<MOST_JOINTS>,
    /// Planned into, so that a failure leaves the motion in force as it is.
    next: Trajectory<MOST_JOINTS>,
    limits: MotionLimits,
    /// At full speed.
    bounds: [JointBounds; MOST_JOINTS],
    range_rad: [[f64; 2]; MOST_JOINTS],
    speed_share: f64,
    /// The share that the motion in force was planned with.
    planned_share: f64,
    /// How fast time passes on the planned trajectory, 0 to 1.
    pace: f64,
    goal: Option<JointPositions>,
    /// A configuration to pass on the way, while it lies ahead.
    by_way_of: Option<JointPositions>,
    /// What `next` leads to, if it was planned from the present state and is not in force.
    considered: Option<Considered>,
    course: Course,
    elapsed_s: f64,
    state: JointState,
    /// Of the plan in force, see [`MotionPlan`].
    plan: u64,
}

/// Where a motion is on its way, for a planner on another thread: see [`ReferenceMotion::follow`].
#[derive(Debug, Clone, Copy, Default)]
pub struct UnderWay {
    state: JointState,
    course: Course,
    elapsed_s: f64,
    pace: f64,
    speed_share: f64,
    planned_share: f64,
    goal: Option<JointPositions>,
    by_way_of: Option<JointPositions>,
    plan: u64,
}

/// Of a plan that has no number yet.
const NEW: u64 = u64::MAX;

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

/// A planned motion on its way from a planner to the one that makes it: it begins where the motion under way will be.
#[derive(Clone)]
pub struct MotionPlan {
    number: u64,
    trajectory: Trajectory<MOST_JOINTS>,
    goal: JointPositions,
    by_way_of: Option<JointPositions>,
    planned_share: f64,
    /// Each joint by itself: the solver found nothing.
    is_alone: bool,
    from: JointState,
    /// The plan that `from` is on, and when.
    on_plan: u64,
    at_s: f64,
}

impl std::fmt::Debug for MotionPlan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MotionPlan")
            .field("number", &self.number)
            .field("from", &self.from)
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
            trajectory: reserved(),
            goal: JointPositions::default(),
            by_way_of: None,
            planned_share: 1.0,
            is_alone: false,
            from: JointState::default(),
            on_plan: 0,
            at_s: 0.0,
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

fn reserved() -> Trajectory<MOST_JOINTS> {
    let mut trajectory = Trajectory::new(None);
    trajectory.reserve_sections(2);
    trajectory
}

impl std::fmt::Debug for ReferenceMotion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ReferenceMotion")
            .field("state", &self.state)
            .field("goal", &self.goal)
            .field("left_s", &self.left_s())
            .finish_non_exhaustive()
    }
}

impl ReferenceMotion {
    /// A motion that has not begun.
    ///
    /// # Errors
    /// Limits outside their ranges, or a start that is not finite.
    pub fn new(
        arm: &dyn ArmKinematics,
        limits: &MotionLimits,
        start: &JointPositions,
    ) -> Result<Self, MotionError> {
        all_finite("start", &start.0)?;
        let bounds = limits.bounds()?;
        let mut otg = Ruckig::with_waypoints(None, 1e-3, 1);
        // Refining takes milliseconds and wins a hundredth of the time.
        otg.waypoint_refinement_sweeps = 0;
        let mut input = InputParameter::with_waypoints(None, 1);
        for i in 0..MOST_JOINTS {
            input.max_acceleration[i] = limits.acceleration_rad_per_s2[i];
            input.max_jerk[i] = limits.jerk_rad_per_s3[i];
        }
        input.max_position = Some(DataArrayOrVec::new(None, f64::INFINITY));
        input.min_position = Some(DataArrayOrVec::new(None, f64::NEG_INFINITY));
        Ok(Self {
            otg,
            input,
            trajectory: reserved(),
            next: reserved(),
            limits: *limits,
            bounds,
            range_rad: arm.limits().map(|l| [l.min_rad, l.max_rad]),
            speed_share: 1.0,
            planned_share: 1.0,
            pace: 1.0,
            goal: None,
            by_way_of: None,
            considered: None,
            course: Course::Rest,
            elapsed_s: 0.0,
            state: JointState::at_rest(*start),
            plan: 0,
        })
    }

    /// How the joints share the time of the motions that are planned from now on.
    #[must_use]
    pub fn with_timing(mut self, timing: JointTiming) -> Self {
        self.input.synchronization = match timing {
            JointTiming::Together => Synchronization::Time,
            JointTiming::Straight => Synchronization::Phase,
            JointTiming::Soonest => Synchronization::None,
        };
        self
    }

    /// The limits at full speed.
    #[must_use]
    pub const fn limits(&self) -> &MotionLimits {
        &self.limits
    }

    /// The state as of the last step.
    #[must_use]
    pub const fn state(&self) -> &JointState {
        &self.state
    }

    /// Where the motion ends; `None` while it brakes or before the first goal.
    #[must_use]
    pub const fn goal(&self) -> Option<&JointPositions> {
        self.goal.as_ref()
    }

    /// Time until the motion ends, s; 0 at rest.
    #[must_use]
    pub fn left_s(&self) -> f64 {
        (self.duration_s() - self.elapsed_s).max(0.0) / self.pace
    }

    /// Least time from the present state until the slowest joint rests at a configuration, s, without planning a motion: the
    /// joints one by one. No motion of all of them together is quicker.
    #[must_use]
    pub fn least_time_to_s(&self, q: &JointPositions) -> f64 {
        if self.state == JointState::at_rest(self.state.q) {
            return self.limits.travel_time_s(&self.state.q, q);
        }
        let each = (0..MOST_JOINTS).map(|i| self.state.joint(i).time_to_s(q[i], &self.bounds[i]));
        each.fold(0.0, |most: f64, time| match time <= most {
            true => most,
            // Later, or NaN, which stays.
            false if most.is_nan() => most,
            false => time,
        })
    }

    fn duration_s(&self) -> f64 {
        match self.course {
            Course::Rest => self.elapsed_s,
            Course::Planned => self.trajectory.duration,
            Course::Alone { duration_s, .. } => duration_s,
        }
    }

    /// Goes on from another state, without a goal: a state in motion comes to rest.
    ///
    /// # Errors
    /// NaN or infinity; nothing is then changed.
    pub fn restart(&mut self, state: &JointState) -> Result<(), MotionError> {
        state.validate()?;
        self.state = *state;
        self.brake_from_here();
        Ok(())
    }

    /// Sets where the motion ends, from the present state on. A goal equal to the last one costs nothing.
    ///
    /// # Errors
    /// A goal that is not finite or outside the joint limits; the motion in force then goes on.
    pub fn set_goal(&mut self, goal: &JointPositions) -> Result<(), MotionError> {
        if self.goal.as_ref() == Some(goal) {
            return Ok(());
        }
        all_finite("goal", &goal.0)?;
        for (q, [least, most]) in goal.0.iter().zip(self.range_rad) {
            let inside = (least..=most).contains(q);
            that(inside, "goal", *q, "within the joint limits")?;
        }
        self.plan(goal, None);
        Ok(())
    }

    /// Plans a motion to a goal without beginning it: [`considered`](Self::considered) tells what it would be, and
    /// [`accept`](Self::accept) begins it. Returns its duration, s.
    ///
    /// If a configuration is given to go by, the motion passes it without stopping, all joints at the same time. From rest to
    /// rest that takes about a hundredth longer than the straight way if the configuration lies beside that; it is not the least
    /// time in general.
    ///
    /// # Errors
    /// As for [`set_goal`](Self::set_goal), or no motion was found; the motion in force goes on.
    pub fn consider(
        &mut self,
        goal: &JointPositions,
        by_way_of: Option<&JointPositions>,
    ) -> Result<f64, MotionError> {
        for (what, q) in [("goal", Some(goal)), ("by_way_of", by_way_of)] {
            let Some(q) = q else { continue };
            all_finite(what, &q.0)?;
            for (q, [least, most]) in q.0.iter().zip(self.range_rad) {
                let inside = (least..=most).contains(q);
                that(inside, what, *q, "within the joint limits")?;
            }
        }
        self.considered = None;
        if !self.calculate(goal, by_way_of) {
            let speed_rad_per_s = self.state.qd.0.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            return Err(MotionError::NoMotion { speed_rad_per_s });
        }
        self.considered = Some(Considered {
            goal: *goal,
            by_way_of: by_way_of.copied(),
        });
        Ok(self.next.duration)
    }

    /// The state of the considered motion after a time, s; that of the motion in force if nothing is considered.
    #[must_use]
    pub fn considered(&self, t_s: f64) -> JointState {
        match self.considered {
            Some(_) if !t_s.is_nan() => evaluated(&self.next, t_s.clamp(0.0, self.next.duration)),
            _ => self.ahead(t_s),
        }
    }

    /// Begins the motion that was considered last, if the state has not changed since; else nothing happens.
    pub fn accept(&mut self) {
        if let Some(Considered { goal, by_way_of }) = self.considered.take() {
            self.begin();
            (self.goal, self.by_way_of) = (Some(goal), by_way_of);
        }
    }

    /// Where the motion is on its way.
    #[must_use]
    pub const fn under_way(&self) -> UnderWay {
        UnderWay {
            state: self.state,
            course: self.course,
            elapsed_s: self.elapsed_s,
            pace: self.pace,
            speed_share: self.speed_share,
            planned_share: self.planned_share,
            goal: self.goal,
            by_way_of: self.by_way_of,
            plan: self.plan,
        }
    }

    /// A planner's copy goes on as the motion that is made does, and so many steps of `dt_s` further. The copy has the trajectory: its
    /// last plan is in force there, or, if that was not taken, the one before.
    pub fn follow(&mut self, under_way: &UnderWay, steps: u32, dt_s: f64) {
        if under_way.course == Course::Planned && under_way.plan != self.plan {
            std::mem::swap(&mut self.trajectory, &mut self.next);
        }
        self.considered = None;
        self.state = under_way.state;
        self.course = under_way.course;
        (self.elapsed_s, self.pace) = (under_way.elapsed_s, under_way.pace);
        (self.speed_share, self.planned_share) = (under_way.speed_share, under_way.planned_share);
        (self.goal, self.by_way_of) = (under_way.goal, under_way.by_way_of);
        self.plan = under_way.plan;
        for _ in 0..steps {
            // A step of finite length cannot fail.
            let _ = self.step(dt_s);
        }
    }

    /// Was a motion begun here since [`follow`](Self::follow)?
    #[must_use]
    pub const fn is_begun(&self) -> bool {
        self.plan == NEW
    }

    /// Copies the motion that has just been begun here for the one that makes it. `begins`: where it begins, before it was begun.
    pub fn offer(&mut self, begins: &UnderWay, number: u64, plan: &mut MotionPlan) {
        self.plan = number;
        plan.number = number;
        plan.is_alone = self.course != Course::Planned;
        if !plan.is_alone {
            plan.trajectory.clone_from(&self.trajectory);
        }
        plan.goal = self.goal.unwrap_or(self.state.q);
        (plan.by_way_of, plan.planned_share) = (self.by_way_of, self.planned_share);
        (plan.from, plan.on_plan, plan.at_s) = (begins.state, begins.plan, begins.elapsed_s);
    }

    /// How long until a plan begins, s; `None` if the motion does not come to where it begins.
    #[must_use]
    pub fn begins_in_s(&self, plan: &MotionPlan) -> Option<f64> {
        if self.state.is_near(&plan.from, SAME_STATE) {
            return Some(0.0);
        }
        let is_ahead = self.course != Course::Rest && plan.on_plan == self.plan;
        let left_s = (plan.at_s - self.elapsed_s) / self.pace;
        (is_ahead && left_s > 0.0).then_some(left_s)
    }

    /// Begins a plan if the state is the one that it begins from. Was it? What was in force is in the plan then.
    pub fn take(&mut self, plan: &mut MotionPlan) -> bool {
        if !self.state.is_near(&plan.from, SAME_STATE) {
            return false;
        }
        (self.goal, self.by_way_of) = (Some(plan.goal), plan.by_way_of);
        (self.planned_share, self.considered) = (plan.planned_share, None);
        if plan.is_alone {
            self.planned_share = self.speed_share;
            self.go_alone(|joint, bounds, i| joint.time_to_s(plan.goal[i], bounds));
        } else {
            std::mem::swap(&mut self.trajectory, &mut plan.trajectory);
            (self.course, self.elapsed_s, self.pace) = (Course::Planned, 0.0, 1.0);
        }
        self.plan = plan.number;
        true
    }

    /// A configuration that the motion still has to pass.
    #[must_use]
    pub const fn by_way_of(&self) -> Option<&JointPositions> {
        self.by_way_of.as_ref()
    }

    /// Sets the share of the speeds that may be used, at least 0.001 and at most 1; a motion to a goal is planned anew if it
    /// changes. Accelerations stay as they are.
    ///
    /// # Errors
    /// A share outside its range; the motion in force then goes on.
    pub fn set_speed_share(&mut self, share: f64) -> Result<(), MotionError> {
        self.set_speed_share_on_way(share)?;
        self.plan_anew();
        Ok(())
    }

    /// Sets the same share without planning: the motion in force keeps to its way. If it is faster, it slows down on it, all
    /// joints alike and as fast as their accelerations allow beside those of the way (their jerk is not limited while it does);
    /// if it could be faster than it was planned, it is not before [`plan_anew`](Self::plan_anew) or another motion.
    ///
    /// # Errors
    /// As for [`set_speed_share`](Self::set_speed_share).
    pub fn set_speed_share_on_way(&mut self, share: f64) -> Result<(), MotionError> {
        let in_range = (1e-3..=1.0).contains(&share);
        that(in_range, "speed_share", share, "between 0.001 and 1")?;
        if share != self.speed_share {
            self.speed_share = share;
            if let (Course::Alone { .. }, Some(goal)) = (self.course, self.goal) {
                // It is worked out from the share in every step.
                self.planned_share = share;
                self.go_alone(|joint, bounds, i| joint.time_to_s(goal[i], bounds));
            }
        }
        Ok(())
    }

    /// The share of the speeds that the motion in force was planned with.
    #[must_use]
    pub const fn planned_share(&self) -> f64 {
        self.planned_share
    }

    /// Does the motion in force go as slowly as the share of the speeds asks for? One that still slows down on its way does not.
    #[must_use]
    pub fn has_slowed_on_way(&self) -> bool {
        let wanted = (self.speed_share / self.planned_share).min(1.0);
        self.course != Course::Planned || self.pace <= wanted
    }

    /// The share that the motion in force keeps to at present: while it slows down, more than [`speed_share`](Self::speed_share).
    #[must_use]
    pub const fn present_share(&self) -> f64 {
        self.planned_share * self.pace
    }

    /// The share of the speeds for motions that are planned from now on.
    #[must_use]
    pub const fn speed_share(&self) -> f64 {
        self.speed_share
    }

    /// Plans a motion to a goal anew from the present state, if it was planned with another share of the speeds.
    pub fn plan_anew(&mut self) {
        if self.planned_share != self.speed_share
            && let Some(goal) = self.goal.filter(|_| self.course != Course::Rest)
        {
            let by_way_of = self.by_way_of;
            self.plan(&goal, by_way_of.as_ref());
        }
    }

    /// Comes to rest, each joint as fast as its limits allow, and forgets the goal.
    pub fn brake(&mut self) {
        let is_braking = self.goal.is_none() && self.course != Course::Rest;
        if !is_braking {
            self.brake_from_here();
        }
    }

    fn brake_from_here(&mut self) {
        (self.goal, self.by_way_of, self.considered) = (None, None, None);
        let at_rest = self.state == JointState::at_rest(self.state.q);
        if at_rest {
            self.course = Course::Rest;
        } else {
            self.go_alone(|joint, bounds, _| joint.time_to_stop_s(bounds));
        }
    }

    /// The state `dt_s` later.
    ///
    /// # Errors
    /// A step that is negative, NaN or infinite; nothing then moves.
    pub fn step(&mut self, dt_s: f64) -> Result<JointState, MotionError> {
        non_negative("dt_s", dt_s)?;
        if self.course != Course::Rest {
            self.considered = None;
            self.state = match self.course {
                Course::Planned => self.paced_step(dt_s),
                _ => {
                    self.elapsed_s += dt_s;
                    self.state_at(self.elapsed_s)
                }
            };
            let passed_s = self.trajectory.cumulative_times.first();
            if passed_s.is_some_and(|passed_s| self.elapsed_s >= *passed_s) {
                self.by_way_of = None;
            }
            if self.elapsed_s >= self.duration_s() {
                self.course = Course::Rest;
            }
        }
        Ok(self.state)
    }

    /// The state that the motion in force will have further on; NaN if the time is.
    #[must_use]
    pub fn ahead(&self, ahead_s: f64) -> JointState {
        match self.course {
            Course::Rest => self.state,
            _ if ahead_s <= 0.0 => self.state,
            _ => slowed(
                self.state_at(self.elapsed_s + ahead_s * self.pace),
                self.pace,
                0.0,
            ),
        }
    }

    /// Goes on along the trajectory, slower or faster by and by if the share of the speeds has changed since it was planned.
    ///
    /// With time passing at a pace r, the acceleration is r² a + r' v for a and v of the trajectory: r' is limited so that no joint
    /// needs more than its own.
    fn paced_step(&mut self, dt_s: f64) -> JointState {
        let wanted = (self.speed_share / self.planned_share).min(1.0);
        let (before, mut rate) = (self.pace, 0.0);
        if before != wanted && dt_s > 0.0 {
            let at = self.state_at(self.elapsed_s);
            let sign = (wanted - before).signum();
            let mut most = (wanted - before).abs() / dt_s;
            for i in 0..MOST_JOINTS {
                let (v, a) = (at.qd[i], at.qdd_rad_per_s2[i] * before * before);
                let most_of_joint = self.bounds[i].acceleration_rad_per_s2();
                let spare = most_of_joint - sign * v.signum() * a;
                // The velocity changes within the step.
                let v = v.abs() + (at.qdd_rad_per_s2[i] * dt_s).abs();
                if v != 0.0 {
                    most = most.min(spare.clamp(0.0, most_of_joint) / v);
                }
            }
            rate = sign * most;
            self.pace = before + rate * dt_s;
            if (self.pace - wanted) * sign >= -1e-12 {
                self.pace = wanted;
            }
        }
        self.elapsed_s += 0.5 * (before + self.pace) * dt_s;
        slowed(self.state_at(self.elapsed_s), self.pace, rate)
    }

    /// The state at a time since the motion in force was planned.
    fn state_at(&self, t_s: f64) -> JointState {
        let mut state = JointState::default();
        match &self.course {
            Course::Rest => return self.state,
            // The trajectory has no answer to that.
            _ if t_s.is_nan() => return JointState::at_rest(JointPositions([t_s; MOST_JOINTS])),
            Course::Planned => {
                state = evaluated(&self.trajectory, t_s);
            }
            Course::Alone { from, .. } => {
                for i in 0..MOST_JOINTS {
                    let (joint, bounds) = (from.joint(i), self.bounds_of(i));
                    let joint = match &self.goal {
                        Some(goal) => joint.towards(goal[i], &bounds, t_s),
                        None => joint.braked(&bounds, t_s),
                    };
                    state.set_joint(i, &joint);
                }
            }
        }
        if t_s >= self.duration_s() {
            // Exactly at the goal, and exactly at rest.
            return JointState::at_rest(self.goal.unwrap_or(state.q));
        }
        for (q, [least, most]) in state.q.0.iter_mut().zip(self.range_rad) {
            // Rounding may leave a limit; a start outside may not be moved.
            if (*q - most).abs() < ROUNDING_RAD || (*q - least).abs() < ROUNDING_RAD {
                *q = q.clamp(least, most);
            }
        }
        state
    }

    fn bounds_of(&self, joint: usize) -> JointBounds {
        self.bounds[joint].at_share(self.speed_share)
    }

    /// Moves each joint by itself from the present state, for the longest of their times.
    fn go_alone(&mut self, time_s: impl Fn(&JointPoint, &JointBounds, usize) -> f64) {
        let times = (0..MOST_JOINTS).map(|i| time_s(&self.state.joint(i), &self.bounds_of(i), i));
        self.course = Course::Alone {
            from: self.state,
            duration_s: times.fold(0.0, f64::max),
        };
        (self.pace, self.elapsed_s) = (1.0, 0.0);
    }

    /// Plans into `next`; was a motion found?
    fn calculate(&mut self, goal: &JointPositions, by_way_of: Option<&JointPositions>) -> bool {
        let input = &mut self.input;
        input.intermediate_positions.clear();
        if let Some(q) = by_way_of {
            let mut passed = DataArrayOrVec::new(None, 0.0);
            for i in 0..MOST_JOINTS {
                passed[i] = q[i];
            }
            input.intermediate_positions.push(passed);
        }
        for i in 0..MOST_JOINTS {
            let bounds = self.bounds[i].at_share(self.speed_share);
            // On the very edge of the speed limit the solver may take rounding for a speed beyond it, and stops first.
            let v = bounds.velocity_rad_per_s();
            let coming = self.state.joint(i).coming_velocity_rad_per_s(&bounds);
            let is_edge = (coming.abs() - v).abs() < SPEED_EDGE * v;
            input.max_velocity[i] = if is_edge {
                v * (1.0 + 2.0 * SPEED_EDGE)
            } else {
                v
            };
            input.current_position[i] = self.state.q[i];
            input.current_velocity[i] = self.state.qd[i];
            input.current_acceleration[i] = self.state.qdd_rad_per_s2[i];
            input.target_position[i] = goal[i];
            // Only what can stop inside the joint limits can be kept inside them.
            let [least, most] = self.range_rad[i];
            let stop = self.state.joint(i).stopping_point_rad(&bounds);
            let kept = [self.state.q[i], stop]
                .iter()
                .all(|q| (least..=most).contains(q));
            let [least, most] = match kept {
                true => [least, most],
                false => [f64::NEG_INFINITY, f64::INFINITY],
            };
            if let Some(position) = input.min_position.as_mut() {
                position[i] = least;
            }
            if let Some(position) = input.max_position.as_mut() {
                position[i] = most;
            }
        }
        // Its root finder panics on NaN, which inputs near its limits can lead to.
        let (otg, next) = (&mut self.otg, &mut self.next);
        let found = catch_unwind(AssertUnwindSafe(|| {
            otg.calculate(&self.input, next).is_ok()
        }));
        found.unwrap_or(false) && self.next.duration.is_finite()
    }

    fn plan(&mut self, goal: &JointPositions, by_way_of: Option<&JointPositions>) {
        self.planned_share = self.speed_share;
        if self.calculate(goal, by_way_of) {
            self.begin();
            self.by_way_of = by_way_of.copied();
        } else {
            self.goal = Some(*goal);
            (self.by_way_of, self.considered) = (None, None);
            self.go_alone(|joint, bounds, i| joint.time_to_s(goal[i], bounds));
        }
        (self.goal, self.plan) = (Some(*goal), NEW);
    }

    /// The motion planned last is in force from now on.
    fn begin(&mut self) {
        std::mem::swap(&mut self.trajectory, &mut self.next);
        (self.planned_share, self.pace) = (self.speed_share, 1.0);
        self.considered = None;
        (self.course, self.elapsed_s, self.plan) = (Course::Planned, 0.0, NEW);
    }
}

/// The state of a trajectory where time passes at a pace that changes at a rate, 1/s.
fn slowed(mut state: JointState, pace: f64, rate_per_s: f64) -> JointState {
    for i in 0..MOST_JOINTS {
        state.set_joint(i, &state.joint(i).at_pace(pace, rate_per_s));
    }
    state
}

/// The state of a trajectory at a time, s.
fn evaluated(trajectory: &Trajectory<MOST_JOINTS>, t_s: f64) -> JointState {
    let mut state = JointState::default();
    trajectory.state_to_integrate_from(t_s, &mut 0, |i, t, p, v, a, j| {
        let from = JointPoint {
            q_rad: p,
            qd_rad_per_s: v,
            qdd_rad_per_s2: a,
        };
        state.set_joint(i, &from.jerked(j, t));
    });
    state
}
