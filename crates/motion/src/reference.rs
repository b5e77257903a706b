//! The commanded motion of the arm.

use crate::error::MotionError;
use crate::joint::{JointBounds, JointPoint};
use crate::joint_state::JointState;
use crate::limits::MotionLimits;
use crate::solver::{JointTiming, Solver, Way};
use crate::under_way::{Course, UnderWay};
use hwall_kinematics::{ArmKinematics, JointPositions, MOST_JOINTS};
use hwall_numeric::check::{all_finite, non_negative, within};

/// A plan may exceed a joint limit by this through rounding, rad.
const ROUNDING_RAD: f64 = 1e-9;

/// A planned motion that has not begun.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Considered {
    goal: JointPositions,
    by_way_of: Option<JointPositions>,
}

/// A jerk-limited, time-optimal motion of all joints to a goal at rest, which may be replaced at any time.
///
/// The motion is planned once for each goal, then only evaluated. It keeps the limits of speed, acceleration, jerk and position from every state
/// that allows it; from a state beyond a limit it first returns within the limit. For braking, and for the rare states for which the solver finds
/// no motion (about one in 250,000), each joint moves on its own ([`JointPoint`]), which always finds a motion.
///
/// Nothing is allocated after construction, except the message of a solver failure. Planning: [Berscheid and Kröger 2021], by the crate `rsruckig`.
/// Error: a plan ends up to 1e-8 rad from the goal, which is then set exactly; durations equal the minimum of the slowest joint to 1e-9 s
/// (tests/it/reference.rs). From speeds above the limit, after a smaller share was set, they are up to 20 ms longer, because the joint slows down
/// first.
#[derive(Clone)]
pub struct ReferenceMotion {
    solver: Solver,
    pub(crate) way: Way,
    /// The plan is written here, so that a failure leaves the current motion unchanged.
    pub(crate) next: Way,
    limits: MotionLimits,
    /// Bounds at full speed.
    bounds: [JointBounds; MOST_JOINTS],
    range_rad: [[f64; 2]; MOST_JOINTS],
    /// Goal of `next`, if it was planned from the present state and has not begun.
    pub(crate) considered: Option<Considered>,
    pub(crate) now: UnderWay,
}

/// Marks a plan that has no number yet.
pub(crate) const NEW: u64 = u64::MAX;

impl std::fmt::Debug for ReferenceMotion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ReferenceMotion")
            .field("state", &self.now.state)
            .field("goal", &self.now.goal)
            .field("left_s", &self.left_s())
            .finish_non_exhaustive()
    }
}

impl ReferenceMotion {
    /// A motion at rest at `start`.
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
        Ok(Self {
            solver: Solver::new(limits),
            way: Way::reserved(),
            next: Way::reserved(),
            limits: *limits,
            bounds,
            range_rad: arm.limits().map(|l| [l.min_rad, l.max_rad]),
            considered: None,
            now: UnderWay {
                state: JointState::at_rest(*start),
                time_scale: 1.0,
                speed_share: 1.0,
                planned_share: 1.0,
                ..UnderWay::default()
            },
        })
    }

    /// Sets how the joints share the time of motions planned from now on.
    #[must_use]
    pub fn with_timing(mut self, timing: JointTiming) -> Self {
        self.solver.set_timing(timing);
        self
    }

    /// The limits at full speed.
    #[must_use]
    pub const fn limits(&self) -> &MotionLimits {
        &self.limits
    }

    /// The state after the last step.
    #[must_use]
    pub const fn state(&self) -> &JointState {
        &self.now.state
    }

    /// The end of the motion; `None` while it brakes or before the first goal.
    #[must_use]
    pub const fn goal(&self) -> Option<&JointPositions> {
        self.now.goal.as_ref()
    }

    /// Time until the motion ends, s; 0 at rest.
    #[must_use]
    pub fn left_s(&self) -> f64 {
        (self.duration_s() - self.now.elapsed_s).max(0.0) / self.now.time_scale
    }

    /// Least time from the present state until the slowest joint rests at a configuration, s, each joint on its own, without planning. No motion of
    /// all joints together is quicker.
    #[must_use]
    pub fn least_time_to_s(&self, q: &JointPositions) -> f64 {
        if self.now.state == JointState::at_rest(self.now.state.q) {
            return self.limits.travel_time_s(&self.now.state.q, q);
        }
        let each =
            (0..MOST_JOINTS).map(|i| self.now.state.joint(i).time_to_s(q[i], &self.bounds[i]));
        each.fold(0.0, |most: f64, time| match time <= most {
            true => most,
            // Later, or NaN, which propagates.
            false if most.is_nan() => most,
            false => time,
        })
    }

    fn check_inside(&self, what: &'static str, q: &JointPositions) -> Result<(), MotionError> {
        all_finite(what, &q.0)?;
        for (&q, [least, most]) in q.0.iter().zip(self.range_rad) {
            within(what, q, least..=most, "within the joint limits")?;
        }
        Ok(())
    }

    fn duration_s(&self) -> f64 {
        match self.now.course {
            Course::Rest => self.now.elapsed_s,
            Course::Planned => self.way.duration_s(),
            Course::Alone { duration_s, .. } => duration_s,
        }
    }

    /// Continues from another state, without a goal: a moving state comes to rest.
    ///
    /// # Errors
    /// NaN or infinity; nothing is then changed.
    pub fn restart(&mut self, state: &JointState) -> Result<(), MotionError> {
        state.validate()?;
        self.now.state = *state;
        self.brake_from_here();
        Ok(())
    }

    /// Sets the end of the motion, from the present state on. Repeating the last goal costs nothing.
    ///
    /// # Errors
    /// A goal that is not finite or outside the joint limits; the current motion then continues.
    pub fn set_goal(&mut self, goal: &JointPositions) -> Result<(), MotionError> {
        if self.now.goal.as_ref() == Some(goal) {
            return Ok(());
        }
        self.check_inside("goal", goal)?;
        self.plan(goal, None);
        Ok(())
    }

    /// Plans a motion to a goal without beginning it: [`considered`](Self::considered) previews it, and [`accept`](Self::accept) begins it. Returns
    /// its duration, s.
    ///
    /// The motion passes `by_way_of`, if given, without stopping, all joints at the same time. From rest to rest this takes about one percent longer
    /// than the straight path if the configuration is close to that; in general it is not time-optimal.
    ///
    /// # Errors
    /// As for [`set_goal`](Self::set_goal), or no motion was found; the current motion continues.
    pub fn consider(
        &mut self,
        goal: &JointPositions,
        by_way_of: Option<&JointPositions>,
    ) -> Result<f64, MotionError> {
        for (what, q) in [("goal", Some(goal)), ("by_way_of", by_way_of)] {
            q.map_or(Ok(()), |q| self.check_inside(what, q))?;
        }
        self.considered = None;
        if !self.calculate(goal, by_way_of) {
            let speed_rad_per_s = self
                .now
                .state
                .qd
                .0
                .iter()
                .fold(0.0, |m: f64, v| m.max(v.abs()));
            return Err(MotionError::NoMotion { speed_rad_per_s });
        }
        self.considered = Some(Considered {
            goal: *goal,
            by_way_of: by_way_of.copied(),
        });
        Ok(self.next.duration_s())
    }

    /// The state of the considered motion after a time, s; that of the current motion if none is considered.
    #[must_use]
    pub fn considered(&self, t_s: f64) -> JointState {
        match self.considered {
            Some(_) if !t_s.is_nan() => self.next.at(t_s.clamp(0.0, self.next.duration_s())),
            _ => self.ahead(t_s),
        }
    }

    /// Begins the last considered motion if the state has not changed since; otherwise does nothing.
    pub fn accept(&mut self) {
        if let Some(Considered { goal, by_way_of }) = self.considered.take() {
            self.begin();
            (self.now.goal, self.now.by_way_of) = (Some(goal), by_way_of);
        }
    }

    /// A configuration that the motion still has to pass.
    #[must_use]
    pub const fn by_way_of(&self) -> Option<&JointPositions> {
        self.now.by_way_of.as_ref()
    }

    /// Sets the share of the speeds that may be used, from 0.001 to 1; if it changes, a motion to a goal is planned again. Acceleration
    /// limits stay the same.
    ///
    /// # Errors
    /// A share outside its range; the current motion then continues.
    pub fn set_speed_share(&mut self, share: f64) -> Result<(), MotionError> {
        self.set_speed_share_on_way(share)?;
        self.plan_anew();
        Ok(())
    }

    /// Sets the share without planning: the current motion keeps its path. If it is faster than allowed, it slows down along the path, all joints
    /// alike and as fast as their remaining accelerations allow (without a jerk limit). It speeds up beyond its planned share only after
    /// [`plan_anew`](Self::plan_anew) or with another motion.
    ///
    /// # Errors
    /// As for [`set_speed_share`](Self::set_speed_share).
    pub fn set_speed_share_on_way(&mut self, share: f64) -> Result<(), MotionError> {
        within("speed_share", share, 1e-3..=1.0, "between 0.001 and 1")?;
        if share != self.now.speed_share {
            self.now.speed_share = share;
            if let (Course::Alone { .. }, Some(goal)) = (self.now.course, self.now.goal) {
                // Computed from the share in every step.
                self.now.planned_share = share;
                self.go_alone(|joint, bounds, i| joint.time_to_s(goal[i], bounds));
            }
        }
        Ok(())
    }

    /// The speed share that the current motion was planned with.
    #[must_use]
    pub const fn planned_share(&self) -> f64 {
        self.now.planned_share
    }

    /// Has the current motion slowed down to the set speed share?
    #[must_use]
    pub fn has_slowed_on_way(&self) -> bool {
        let wanted = (self.now.speed_share / self.now.planned_share).min(1.0);
        self.now.course != Course::Planned || self.now.time_scale <= wanted
    }

    /// The present speed share of the current motion: above [`speed_share`](Self::speed_share) while it slows down.
    #[must_use]
    pub const fn present_share(&self) -> f64 {
        self.now.planned_share * self.now.time_scale
    }

    /// The speed share for motions planned from now on.
    #[must_use]
    pub const fn speed_share(&self) -> f64 {
        self.now.speed_share
    }

    /// Plans the motion to the goal again from the present state, if it was planned with another speed share.
    pub fn plan_anew(&mut self) {
        if self.now.planned_share != self.now.speed_share
            && let Some(goal) = self.now.goal.filter(|_| self.now.course != Course::Rest)
        {
            let by_way_of = self.now.by_way_of;
            self.plan(&goal, by_way_of.as_ref());
        }
    }

    /// Brakes each joint as fast as its limits allow, and forgets the goal.
    pub fn brake(&mut self) {
        let is_braking = self.now.goal.is_none() && self.now.course != Course::Rest;
        if !is_braking {
            self.brake_from_here();
        }
    }

    fn brake_from_here(&mut self) {
        (self.now.goal, self.now.by_way_of, self.considered) = (None, None, None);
        let at_rest = self.now.state == JointState::at_rest(self.now.state.q);
        if at_rest {
            self.now.course = Course::Rest;
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
        if self.now.course != Course::Rest {
            self.considered = None;
            self.now.state = match self.now.course {
                Course::Planned => self.paced_step(dt_s),
                _ => {
                    self.now.elapsed_s += dt_s;
                    self.state_at(self.now.elapsed_s)
                }
            };
            let passed_s = self.way.0.cumulative_times.first();
            if passed_s.is_some_and(|passed_s| self.now.elapsed_s >= *passed_s) {
                self.now.by_way_of = None;
            }
            if self.now.elapsed_s >= self.duration_s() {
                self.now.course = Course::Rest;
            }
        }
        Ok(self.now.state)
    }

    /// The state of the current motion after a further time; NaN if the time is.
    #[must_use]
    pub fn ahead(&self, ahead_s: f64) -> JointState {
        match self.now.course {
            Course::Rest => self.now.state,
            _ if ahead_s <= 0.0 => self.now.state,
            _ => slowed(
                self.state_at(self.now.elapsed_s + ahead_s * self.now.time_scale),
                self.now.time_scale,
                0.0,
            ),
        }
    }

    /// Continues along the trajectory and gradually adapts to a changed speed share.
    ///
    /// Under a time scale r the acceleration is r² a + r' v, with a and v of the trajectory: r' is limited so that no joint exceeds its acceleration
    /// limit.
    fn paced_step(&mut self, dt_s: f64) -> JointState {
        let wanted = (self.now.speed_share / self.now.planned_share).min(1.0);
        let (before, mut rate) = (self.now.time_scale, 0.0);
        if before != wanted && dt_s > 0.0 {
            let at = self.state_at(self.now.elapsed_s);
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
            self.now.time_scale = before + rate * dt_s;
            if (self.now.time_scale - wanted) * sign >= -1e-12 {
                self.now.time_scale = wanted;
            }
        }
        self.now.elapsed_s += 0.5 * (before + self.now.time_scale) * dt_s;
        slowed(self.state_at(self.now.elapsed_s), self.now.time_scale, rate)
    }

    /// The state at a time since the current motion was planned.
    fn state_at(&self, t_s: f64) -> JointState {
        let mut state = JointState::default();
        match &self.now.course {
            Course::Rest => return self.now.state,
            // The trajectory cannot be evaluated at NaN.
            _ if t_s.is_nan() => return JointState::at_rest(JointPositions([t_s; MOST_JOINTS])),
            Course::Planned => {
                state = self.way.at(t_s);
            }
            Course::Alone { from, .. } => {
                for i in 0..MOST_JOINTS {
                    let (joint, bounds) = (from.joint(i), self.bounds_of(i));
                    let joint = match &self.now.goal {
                        Some(goal) => joint.towards(goal[i], &bounds, t_s),
                        None => joint.braked(&bounds, t_s),
                    };
                    state.set_joint(i, &joint);
                }
            }
        }
        if t_s >= self.duration_s() {
            // Exactly at the goal, and exactly at rest.
            return JointState::at_rest(self.now.goal.unwrap_or(state.q));
        }
        for (q, [least, most]) in state.q.0.iter_mut().zip(self.range_rad) {
            // Rounding may exceed a limit; a start outside the limits must not be moved.
            if (*q - most).abs() < ROUNDING_RAD || (*q - least).abs() < ROUNDING_RAD {
                *q = q.clamp(least, most);
            }
        }
        state
    }

    fn bounds_of(&self, joint: usize) -> JointBounds {
        self.bounds[joint].at_share(self.now.speed_share)
    }

    /// Moves each joint on its own from the present state; the duration is the longest of their times.
    pub(crate) fn go_alone(&mut self, time_s: impl Fn(&JointPoint, &JointBounds, usize) -> f64) {
        let times =
            (0..MOST_JOINTS).map(|i| time_s(&self.now.state.joint(i), &self.bounds_of(i), i));
        self.now.course = Course::Alone {
            from: self.now.state,
            duration_s: times.fold(0.0, f64::max),
        };
        (self.now.time_scale, self.now.elapsed_s) = (1.0, 0.0);
    }

    /// Plans into `next`; was a motion found?
    fn calculate(&mut self, goal: &JointPositions, by_way_of: Option<&JointPositions>) -> bool {
        let bounds = std::array::from_fn(|i| self.bounds_of(i));
        let (from, range_rad, next) = (&self.now.state, &self.range_rad, &mut self.next);
        self.solver
            .plan(from, (goal, by_way_of), &bounds, range_rad, next)
    }

    fn plan(&mut self, goal: &JointPositions, by_way_of: Option<&JointPositions>) {
        self.now.planned_share = self.now.speed_share;
        let is_found = self.calculate(goal, by_way_of);
        (self.now.goal, self.considered) = (Some(*goal), None);
        self.now.by_way_of = by_way_of.copied().filter(|_| is_found);
        if is_found {
            self.begin();
        } else {
            self.go_alone(|joint, bounds, i| joint.time_to_s(goal[i], bounds));
        }
        self.now.plan = NEW;
    }

    /// Begins the last planned motion.
    fn begin(&mut self) {
        std::mem::swap(&mut self.way, &mut self.next);
        (self.now.planned_share, self.now.time_scale) = (self.now.speed_share, 1.0);
        self.considered = None;
        (self.now.course, self.now.elapsed_s, self.now.plan) = (Course::Planned, 0.0, NEW);
    }
}

/// The state of a trajectory under a time scale `time_scale` that changes at a rate, 1/s.
fn slowed(mut state: JointState, time_scale: f64, rate_per_s: f64) -> JointState {
    for i in 0..MOST_JOINTS {
        state.set_joint(i, &state.joint(i).at_time_scale(time_scale, rate_per_s));
    }
    state
}
