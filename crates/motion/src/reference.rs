//! The motion that the arm is told to make.

use crate::error::MotionError;
use crate::limits::MotionLimits;
use hwall_kinematics::{ArmKinematics, JointPositions, JointVelocities, MOST_JOINTS};
use hwall_numeric::check::{all_finite, non_negative, that};
use rsruckig::prelude::*;

/// Position, velocity and acceleration of all joints at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointState {
    /// rad.
    pub q: JointPositions,
    /// rad/s.
    pub qd: JointVelocities,
    /// rad/s².
    pub qdd_rad_per_s2: [f64; MOST_JOINTS],
}

impl JointState {
    /// Standing still.
    #[must_use]
    pub fn at_rest(q: JointPositions) -> Self {
        Self {
            q,
            ..Self::default()
        }
    }

    fn validate(&self) -> Result<(), MotionError> {
        all_finite("q", &self.q.0)?;
        all_finite("qd", &self.qd.0)?;
        all_finite("qdd_rad_per_s2", &self.qdd_rad_per_s2)?;
        Ok(())
    }
}

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

/// A jerk-limited, time-optimal motion of all joints to a goal at rest, which may be replaced at any time.
///
/// Planned once for each goal, then only evaluated. The limits of speed, acceleration, jerk and position are kept from any
/// state within them; a state beyond a limit is first brought back within it. Nothing is allocated after construction.
/// Planning: [Berscheid and Kröger 2021], by the crate `rsruckig`.
pub struct ReferenceMotion {
    otg: Ruckig<MOST_JOINTS, ThrowErrorHandler>,
    input: InputParameter<MOST_JOINTS>,
    trajectory: Trajectory<MOST_JOINTS>,
    /// Planned into, so that a failure leaves the motion in force as it is.
    next: Trajectory<MOST_JOINTS>,
    limits: MotionLimits,
    range_rad: [[f64; 2]; MOST_JOINTS],
    speed_share: f64,
    goal: Option<JointPositions>,
    /// A configuration to pass on the way, while it lies ahead.
    by_way_of: Option<JointPositions>,
    /// The goal of `next` and what it passes, if that was planned from the present state and is not in force.
    considered: Option<Considered>,
    under_way: bool,
    elapsed_s: f64,
    state: JointState,
}

/// A motion that was planned and is not in force.
#[derive(Debug, Clone, Copy)]
struct Considered {
    goal: JointPositions,
    by_way_of: Option<JointPositions>,
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

impl Clone for ReferenceMotion {
    /// The same motion from the present state on.
    fn clone(&self) -> Self {
        let mut copy = Self::with_ranges(self.range_rad, &self.limits, self.state);
        copy.speed_share = self.speed_share;
        copy.input.synchronization = self.input.synchronization;
        copy.input.copy_from(&self.input);
        copy.trajectory = self.trajectory.clone();
        (copy.goal, copy.under_way, copy.elapsed_s) = (self.goal, self.under_way, self.elapsed_s);
        copy.by_way_of = self.by_way_of;
        copy
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
        limits.validate()?;
        all_finite("start", &start.0)?;
        let range_rad = arm.limits().map(|l| [l.min_rad, l.max_rad]);
        Ok(Self::with_ranges(
            range_rad,
            limits,
            JointState::at_rest(*start),
        ))
    }

    fn with_ranges(
        range_rad: [[f64; 2]; MOST_JOINTS],
        limits: &MotionLimits,
        state: JointState,
    ) -> Self {
        let mut otg = Ruckig::with_waypoints(None, 1e-3, 1);
        // The refinement takes milliseconds and wins a hundredth of the time.
        otg.waypoint_refinement_sweeps = 0;
        let reserved = || {
            let mut trajectory = Trajectory::new(None);
            trajectory.reserve_sections(2);
            trajectory
        };
        let mut input = InputParameter::with_waypoints(None, 1);
        for i in 0..MOST_JOINTS {
            input.max_acceleration[i] = limits.acceleration_rad_per_s2[i];
            input.max_jerk[i] = limits.jerk_rad_per_s3[i];
        }
        input.max_position = Some(DataArrayOrVec::new(None, f64::INFINITY));
        input.min_position = Some(DataArrayOrVec::new(None, f64::NEG_INFINITY));
        Self {
            otg,
            input,
            trajectory: reserved(),
            next: reserved(),
            limits: *limits,
            range_rad,
            speed_share: 1.0,
            goal: None,
            by_way_of: None,
            considered: None,
            under_way: false,
            elapsed_s: 0.0,
            state,
        }
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

    /// A configuration that the motion still has to pass.
    #[must_use]
    pub const fn by_way_of(&self) -> Option<&JointPositions> {
        self.by_way_of.as_ref()
    }

    /// Time until the motion ends, s; 0 at rest.
    #[must_use]
    pub fn left_s(&self) -> f64 {
        if self.under_way {
            (self.trajectory.duration - self.elapsed_s).max(0.0)
        } else {
            0.0
        }
    }

    /// Goes on from another state, without a goal: the next step brakes.
    ///
    /// # Errors
    /// NaN or infinity; nothing is then changed.
    pub fn restart(&mut self, state: &JointState) -> Result<(), MotionError> {
        state.validate()?;
        self.state = *state;
        (self.goal, self.by_way_of, self.considered) = (None, None, None);
        self.under_way = false;
        Ok(())
    }

    /// Sets where the motion ends, from the present state on. A goal equal to the last one costs nothing.
    ///
    /// # Errors
    /// A goal that is not finite or outside the joint limits, or no motion was found; the motion in force then goes on.
    pub fn set_goal(&mut self, goal: &JointPositions) -> Result<(), MotionError> {
        if self.goal.as_ref() == Some(goal) {
            return Ok(());
        }
        self.consider(goal, None)?;
        self.accept();
        Ok(())
    }

    /// Plans a motion to a goal without beginning it: [`considered`](Self::considered) is what it would be, and
    /// [`accept`](Self::accept) begins it. It passes a configuration on its way if one is given, without stopping there: from rest
    /// to rest that takes a hundredth longer than the straight way to the same goal, if it lies beside it, not the least time in
    /// general. Returns its duration, s.
    ///
    /// # Errors
    /// As for [`set_goal`](Self::set_goal).
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
        self.plan(Some(goal), by_way_of)?;
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
            Some(_) => evaluated(&self.next, t_s),
            None => self.ahead(t_s),
        }
    }

    /// Begins the motion that was considered last, if the state has not changed since; else nothing happens.
    pub fn accept(&mut self) {
        if let Some(Considered { goal, by_way_of }) = self.considered.take() {
            self.begin();
            (self.goal, self.by_way_of) = (Some(goal), by_way_of);
        }
    }

    /// Sets the share of the speeds that may be used, in (0, 1]; the motion in force is planned anew if it changes.
    ///
    /// # Errors
    /// A share outside its range, or no motion was found; the motion in force then goes on.
    pub fn set_speed_share(&mut self, share: f64) -> Result<(), MotionError> {
        let in_range = share > 0.0 && share <= 1.0;
        that(in_range, "speed_share", share, "in (0, 1]")?;
        if share == self.speed_share {
            return Ok(());
        }
        let before = std::mem::replace(&mut self.speed_share, share);
        if let Some(goal) = self.goal {
            let by_way_of = self.by_way_of;
            self.plan(Some(&goal), by_way_of.as_ref())
                .inspect_err(|_| self.speed_share = before)?;
            self.begin();
        }
        Ok(())
    }

    /// Comes to rest as fast as the limits allow and forgets the goal.
    pub fn brake(&mut self) {
        self.by_way_of = None;
        if self.goal.take().is_none() && self.under_way {
            return;
        }
        let at_rest = self.state.qd.0 == [0.0; MOST_JOINTS]
            && self.state.qdd_rad_per_s2 == [0.0; MOST_JOINTS];
        // Braking from a state within the limits is always possible; a failure keeps what is in force.
        if !at_rest && self.plan(None, None).is_ok() {
            self.begin();
        } else if at_rest {
            self.under_way = false;
        }
        if !self.under_way {
            self.state = JointState::at_rest(self.state.q);
        }
    }

    /// The state `dt_s` later.
    ///
    /// # Errors
    /// A step that is negative, NaN or infinite; nothing then moves.
    pub fn step(&mut self, dt_s: f64) -> Result<JointState, MotionError> {
        non_negative("dt_s", dt_s)?;
        self.considered = None;
        if !self.under_way && self.goal.is_none() {
            // After a restart in motion.
            self.brake();
        }
        if self.under_way {
            self.elapsed_s += dt_s;
            self.state = self.within_ranges(evaluated(&self.trajectory, self.elapsed_s));
            if self
                .trajectory
                .cumulative_times
                .first()
                .is_some_and(|passed_s| self.elapsed_s >= *passed_s)
            {
                self.by_way_of = None;
            }
            if self.elapsed_s >= self.trajectory.duration {
                // Exactly at the goal, and exactly at rest.
                let q = self.goal.unwrap_or(self.state.q);
                self.state = JointState::at_rest(q);
                self.under_way = false;
            }
        }
        Ok(self.state)
    }

    /// The state that the motion in force will have further on.
    #[must_use]
    pub fn ahead(&self, ahead_s: f64) -> JointState {
        if self.under_way {
            evaluated(&self.trajectory, self.elapsed_s + ahead_s.max(0.0))
        } else {
            self.state
        }
    }

    /// Rounding may leave a limit by an ulp; a start outside the limits stays legal.
    fn within_ranges(&self, mut state: JointState) -> JointState {
        for (i, [least, most]) in self.range_rad.into_iter().enumerate() {
            let before = self.state.q[i];
            state.q[i] = state.q[i].clamp(least.min(before), most.max(before));
        }
        state
    }

    /// Plans to a goal, or to rest anywhere.
    fn plan(
        &mut self,
        goal: Option<&JointPositions>,
        by_way_of: Option<&JointPositions>,
    ) -> Result<(), MotionError> {
        let input = &mut self.input;
        input.intermediate_positions.clear();
        if let Some(q) = by_way_of {
            let mut passed = DataArrayOrVec::new(None, 0.0);
            for i in 0..MOST_JOINTS {
                passed[i] = q[i];
            }
            input.intermediate_positions.push(passed);
        }
        input.control_interface = match goal {
            Some(_) => ControlInterface::Position,
            None => ControlInterface::Velocity,
        };
        for i in 0..MOST_JOINTS {
            input.max_velocity[i] = self.speed_share * self.limits.velocity_rad_per_s[i];
            input.current_position[i] = self.state.q[i];
            input.current_velocity[i] = self.state.qd[i];
            input.current_acceleration[i] = self.state.qdd_rad_per_s2[i];
            input.target_position[i] = goal.map_or(0.0, |goal| goal[i]);
        }
        // Only a start inside the joint limits can be kept inside them.
        let [least, most] = [&mut input.min_position, &mut input.max_position];
        for (i, [least_rad, most_rad]) in self.range_rad.into_iter().enumerate() {
            let inside = (least_rad..=most_rad).contains(&self.state.q[i]);
            if let (Some(least), Some(most)) = (least.as_mut(), most.as_mut()) {
                least[i] = if inside { least_rad } else { f64::NEG_INFINITY };
                most[i] = if inside { most_rad } else { f64::INFINITY };
            }
        }
        self.otg
            .calculate(input, &mut self.next)
            .ok()
            .filter(|_| self.next.duration.is_finite())
            .ok_or_else(|| MotionError::NoMotion {
                speed_rad_per_s: self.state.qd.0.iter().fold(0.0, |m: f64, v| m.max(v.abs())),
            })?;
        Ok(())
    }

    /// The motion planned last is in force from now on.
    fn begin(&mut self) {
        std::mem::swap(&mut self.trajectory, &mut self.next);
        self.considered = None;
        self.elapsed_s = 0.0;
        self.under_way = true;
    }
}

fn evaluated(trajectory: &Trajectory<MOST_JOINTS>, t_s: f64) -> JointState {
    let mut state = JointState::default();
    let mut section = 0;
    let t_s = t_s.clamp(0.0, trajectory.duration);
    trajectory.state_to_integrate_from(t_s, &mut section, |i, t, p, v, a, j| {
        state.q[i] = p + t * (v + t * (a / 2.0 + t * j / 6.0));
        state.qd[i] = v + t * (a + t * j / 2.0);
        state.qdd_rad_per_s2[i] = a + t * j;
    });
    state
}
