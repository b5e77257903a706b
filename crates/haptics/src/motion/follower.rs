//! From where the board shall be to joint commands within the arm's limits.

use super::barrier::Barrier;
use super::goals::Goals;
use super::profile::{JointBounds, JointMotion};
use super::route::{ApproachConfig, Destination, Route};
use super::search;
use super::slide::{ENDS_S, Slide, Sliding};
use super::solver::{Solver, Stop};
use crate::board::{Board, BoardTarget, QUARTER_TURNS_RAD};
use crate::error::HapticsError;
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_kinematics::{ArmKinematics, JointPositions, JointVelocities, Twist, Unreachable};
use hwall_motion::{JointState, MotionConfig, MotionLimits, ReferenceMotion};
use hwall_numeric::check::{all_finite, non_negative, that};
use std::sync::Arc;

/// Settings of [`Follower`].
#[derive(Debug, Clone, PartialEq)]
pub struct FollowerConfig {
    /// Limits of speed, acceleration and jerk; default those of the iiwa 7 with 0.999 of its speeds, so that rounding does not
    /// pass them.
    pub motion: MotionConfig,
    /// How the board stays behind the surfaces on its way.
    pub approach: ApproachConfig,
    /// Rolls of the board about the normal that may be used, rad, see
    /// [`board_pose`](crate::board_pose); default the quarter turns of a square board.
    pub rolls_rad: Vec<f64>,
    /// A target that moved further than this is a new one, m; default 0.05.
    pub far_m: f64,
    /// A target that turned further than this is a new one, rad; default 0.2.
    pub far_rad: f64,
}

impl Default for FollowerConfig {
    fn default() -> Self {
        Self {
            motion: MotionConfig {
                speed_share: 0.999,
                ..MotionConfig::default()
            },
            approach: ApproachConfig::default(),
            rolls_rad: QUARTER_TURNS_RAD.to_vec(),
            far_m: 0.05,
            far_rad: 0.2,
        }
    }
}

impl FollowerConfig {
    /// Rejects settings outside their ranges and an empty list of rolls. Those of the motion are checked with the arm.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        self.approach.validate()?;
        that(
            !self.rolls_rad.is_empty(),
            "number of rolls",
            0.0,
            "at least 1",
        )?;
        all_finite("rolls_rad", &self.rolls_rad)?;
        non_negative("far_m", self.far_m)?;
        non_negative("far_rad", self.far_rad)?;
        Ok(())
    }
}

/// Rounding of a speed, as a share of it.
const SLOWED: f64 = 1e-3;
/// Joints that turn no faster stand, rad/s.
const STANDS_RAD_PER_S: f64 = 3e-3;
/// A way to a goal that only drifts is planned anew after this time, s: a plan costs as much as ten steps.
const DRIFT_S: f64 = 0.01;

/// Brings the board to where it shall be.
///
/// The goal configuration comes from the inverse kinematics of the arm, closed or numeric. While a target
/// drifts, branch, roll and neighbourhood of the goal are kept; for a new target, or one that is far away, the
/// roll is taken that is reached soonest, close to the configuration that the target names or on the present branch. The
/// joints then arrive together, jerk-limited and in the least time ([`ReferenceMotion`]), behind the surfaces if a board
/// and barriers are given.
///
/// An arm that [searches](ArmKinematics::searches) is asked for a descent from the commanded joints for each roll; where
/// all fail, one roll is searched in each call of [`set_target`](Self::set_target), so that a step stays below about a
/// millisecond for a UR5 or a Panda, also while an unreachable target drifts.
#[derive(Debug, Clone)]
pub struct Follower {
    goals: Goals,
    route: Route,
    reference: ReferenceMotion,
    /// Without jerk, for slides.
    bounds: [JointBounds; 7],
    destination: Option<Destination>,
    /// The destination is new, or something else moved the arm.
    is_to_plan: bool,
    /// The destination only drifted since the last way was planned, and for how long ways were not planned, s.
    has_drifted: bool,
    since_plan_s: f64,
    sliding: Option<Sliding>,
    /// A slide is over, and the joints that it moved are coming to rest.
    ends_slide: bool,
    /// The slide that had to end, and why: one that goes on in its direction is none.
    blocked: Option<(Slide, Unreachable)>,
}

impl Follower {
    /// A step looks at the board at no more instants of possible ways than this, see [`looks`](Self::looks).
    pub const MOST_LOOKS: usize = search::MOST_LOOKS;

    /// A follower at rest at `start`, for an arm whose tool frame is the board's face
    /// ([`Board::flange_from_board_face`](crate::Board::flange_from_board_face)).
    ///
    /// # Errors
    /// As for [`FollowerConfig::validate`]; a limit of the motion outside its range; a start that is not finite.
    pub fn new(
        arm: Arc<dyn ArmKinematics>,
        config: FollowerConfig,
        start: &JointPositions,
    ) -> Result<Self, HapticsError> {
        config.validate()?;
        let limits = MotionLimits::of_arm(&*arm, &config.motion)?;
        let mut bounds = [JointBounds::new(1.0, 1.0)?; 7];
        for (joint, bounds) in bounds.iter_mut().enumerate() {
            *bounds = JointBounds::new(
                limits.velocity_rad_per_s[joint],
                limits.acceleration_rad_per_s2[joint],
            )?;
        }
        let reference = ReferenceMotion::new(&*arm, &limits, start)?;
        Ok(Self {
            route: Route::new(config.approach, None),
            goals: Goals::new(Solver::new(arm), &config),
            reference,
            bounds,
            destination: None,
            is_to_plan: false,
            has_drifted: false,
            since_plan_s: f64::INFINITY,
            sliding: None,
            ends_slide: false,
            blocked: None,
        })
    }

    /// The same for a board of this size, which stays behind the surface that it serves, the one that it served before, and
    /// the barriers of [`set_barriers`](Self::set_barriers).
    #[must_use]
    pub fn with_board(mut self, config: ApproachConfig, board: Board) -> Self {
        self.route = Route::new(config, Some(board));
        self
    }

    /// Surfaces that the board stays behind, besides the one that it serves.
    pub fn set_barriers(&mut self, barriers: &[Barrier]) {
        self.route.set_barriers(barriers);
    }

    /// The same after the world has moved, by `moved` in the base frame: places that the board served go with their surfaces. Nothing
    /// is planned anew.
    pub fn move_barriers(&mut self, barriers: &[Barrier], moved: &Pose) {
        self.route.move_barriers(barriers, moved);
    }

    /// So many barriers will be set without an allocation.
    pub fn reserve_barriers(&mut self, count: usize) {
        self.route.reserve_barriers(count);
    }

    /// How far corners or middle of the commanded face are in front of a surface, m, negative behind all of them; around the
    /// goal only its own surface counts. `None` without a board or barriers.
    #[must_use]
    pub fn protrusion_m(&self) -> Option<f64> {
        let face = self.commanded_pose();
        self.route.protrusion_m(&face, self.goals.goal())
    }

    /// The same at a configuration that is no goal.
    #[must_use]
    pub fn protrusion_at_m(&self, q: &JointPositions) -> Option<f64> {
        self.route.protrusion_m(&self.arm().forward(q), None)
    }

    /// Forgets target and goal and goes on from a measured state. Velocities above the limits
    /// are set to the limits.
    ///
    /// # Errors
    /// NaN or infinity; nothing is then changed.
    pub fn restart(
        &mut self,
        q: &JointPositions,
        qd: &JointVelocities,
    ) -> Result<(), HapticsError> {
        all_finite("q", &q.0)?;
        all_finite("qd", &qd.0)?;
        let mut state = JointState::at_rest(*q);
        for (joint, bounds) in self.bounds.iter().enumerate() {
            let most = bounds.velocity_rad_per_s();
            state.qd[joint] = qd[joint].clamp(-most, most);
        }
        self.reference.restart(&state)?;
        self.goals.forget();
        self.route.forget();
        self.destination = None;
        self.end_slide();
        Ok(())
    }

    /// Sets where the board shall go. A target equal to the last one costs nothing.
    ///
    /// Returns why the board cannot be there, if it cannot; the last goal is then kept. With an arm that
    /// [searches](ArmKinematics::searches) this takes a call for each roll; the answer is `None` until then.
    ///
    /// # Errors
    /// NaN, infinity or a normal without a direction; the last goal is then kept too.
    pub fn set_target(
        &mut self,
        target: &BoardTarget,
    ) -> Result<Option<Unreachable>, HapticsError> {
        let before = self.goals.goal().copied();
        let here = self.reference.state().q;
        let verdict = self.goals.set(target, &self.reference)?;
        if let Some(goal) = self.goals.goal() {
            let is_new = match self.destination {
                Some(Destination::Goal(last)) => last != *goal,
                _ => true,
            };
            if is_new {
                let drifted = before.is_some_and(|before| before.is_beside(goal))
                    && matches!(self.destination, Some(Destination::Goal(_)));
                if let Some(before) = before.filter(|_| !drifted) {
                    self.route.leave(&before, &self.arm().forward(&here));
                }
                self.route.set_goal(goal);
                self.destination = Some(Destination::Goal(*goal));
                self.has_drifted = true;
                self.is_to_plan |= !drifted;
            }
        }
        Ok(verdict)
    }

    /// Sets a posture to go to, wherever the board is then; the target is forgotten.
    ///
    /// # Errors
    /// NaN, infinity, or a posture outside the joint limits; the last goal is then kept.
    pub fn set_posture(&mut self, q: &JointPositions) -> Result<(), HapticsError> {
        if matches!(self.destination, Some(Destination::Posture(last)) if last == *q) {
            return Ok(());
        }
        all_finite("posture", &q.0)?;
        for (joint, limit) in self.arm().limits().iter().enumerate() {
            that(
                limit.contains(q[joint]),
                "posture",
                q[joint],
                "within the joint limits",
            )?;
        }
        if let Some(goal) = self.goals.goal().copied() {
            let here = self.arm().forward(&self.reference.state().q);
            self.route.leave(&goal, &here);
        }
        self.goals.forget();
        self.destination = Some(Destination::Posture(*q));
        self.is_to_plan = true;
        Ok(())
    }

    /// The goal configuration, rad, if a reachable target or a posture was ever set.
    #[must_use]
    pub fn goal(&self) -> Option<JointPositions> {
        self.destination.map(|destination| *destination.q())
    }

    /// Time until the board is at its goal, s; on a detour at least that until the detour ends, and while a way is still being looked for
    /// the least time of the joints. `None` without a goal.
    #[must_use]
    pub fn left_s(&self) -> Option<f64> {
        let destination = self.destination?;
        let is_under_way = self.reference.goal() == Some(destination.q());
        if self.route.is_searching_anew() && !is_under_way && !self.is_detour() {
            return Some(self.reference.least_time_to_s(destination.q()));
        }
        let left_s = self.reference.left_s();
        let detour_s = match self.reference.goal() {
            Some(goal) if goal == destination.q() => 0.0,
            Some(ends) => self.reference.limits().travel_time_s(ends, destination.q()),
            None if self.route.is_blocked() => {
                let here = &self.reference.state().q;
                self.reference.limits().travel_time_s(here, destination.q())
            }
            // Planned in the next step.
            None => 0.0,
        };
        Some(left_s + detour_s)
    }

    /// Least time until all joints could rest at a configuration, s: of the joints one by one, wherever the board is on the way.
    #[must_use]
    pub fn least_time_to_s(&self, q: &JointPositions) -> f64 {
        self.reference.least_time_to_s(q)
    }

    /// Is the board on its way to a place behind the surfaces, from where it goes on to its goal?
    #[must_use]
    pub const fn is_detour(&self) -> bool {
        self.route.is_detour()
    }

    /// Was there no way to the goal behind the surfaces when one was last looked for to the end? The board then ends the motion under
    /// way, and stands.
    #[must_use]
    pub const fn is_blocked(&self) -> bool {
        self.route.is_blocked()
    }

    /// At how many instants of possible ways the board was looked at in the last [`step`](Self::step): usually at none, never at more
    /// than [`MOST_LOOKS`](Self::MOST_LOOKS). A search that needs more goes on in the next step, and so does the motion under way; it
    /// begins anew for a target that leaps or another distance behind the surface, and after braking. Plans and inverse kinematics of the
    /// search count as the looks that take about as long.
    #[must_use]
    pub const fn looks(&self) -> usize {
        self.route.looks()
    }

    /// The configuration that the motion still has to pass on its way behind the surfaces, rad.
    #[must_use]
    pub const fn by_way_of(&self) -> Option<&JointPositions> {
        self.reference.by_way_of()
    }

    /// The configuration commanded last, rad.
    #[must_use]
    pub fn commanded(&self) -> JointPositions {
        self.legal(self.reference.state().q)
    }

    /// The velocity at the configuration commanded last, rad/s.
    #[must_use]
    pub const fn commanded_velocity(&self) -> JointVelocities {
        self.reference.state().qd
    }

    /// Pose of the face at the configuration commanded last.
    #[must_use]
    pub fn commanded_pose(&self) -> Pose {
        self.arm().forward(&self.commanded())
    }

    /// Velocity of the face at the configuration commanded last.
    #[must_use]
    pub fn commanded_twist(&self) -> Twist {
        self.commanded_motion().1
    }

    /// [`commanded_pose`](Self::commanded_pose) and [`commanded_twist`](Self::commanded_twist).
    pub(crate) fn commanded_motion(&self) -> (Pose, Twist) {
        let (face, jacobian) = self.arm().forward_and_jacobian(&self.commanded());
        (face, jacobian.twist(&self.reference.state().qd))
    }

    /// The limits of the motion.
    #[must_use]
    pub const fn limits(&self) -> &MotionLimits {
        self.reference.limits()
    }

    /// The arm with the board as its tool.
    #[must_use]
    pub const fn arm(&self) -> &Arc<dyn ArmKinematics> {
        self.goals.solver.arm()
    }

    /// Sets the share of the joint speeds that may be used, in (0, 1]. A motion that is faster slows down on its way, so that it
    /// stays behind the surfaces; for one that may be faster than it was planned another way is sought.
    ///
    /// # Errors
    /// A share outside its range; the last one is then kept.
    pub fn set_speed_share(&mut self, share: f64) -> Result<(), HapticsError> {
        let before = self.reference.speed_share();
        self.reference.set_speed_share_on_way(share)?;
        self.is_to_plan |= share > before && share > self.reference.planned_share();
        Ok(())
    }

    /// The share of the joint speeds that the motion under way keeps to at present: after
    /// [`set_speed_share`](Self::set_speed_share) it takes a while to slow down.
    #[must_use]
    pub fn present_share(&self) -> f64 {
        let is_under_way = self.reference.goal().is_some() && self.reference.left_s() > 0.0;
        if !is_under_way {
            return self.reference.speed_share();
        }
        let most = &self.reference.limits().velocity_rad_per_s;
        let qd = &self.reference.state().qd.0;
        // A motion that was planned with a smaller share begins at the speed of the one before.
        let fastest = qd.iter().zip(most).map(|(v, most)| v.abs() / most);
        fastest
            .fold(self.reference.present_share(), f64::max)
            .min(1.0)
    }

    /// The least time in which all joints come to rest together, s.
    #[must_use]
    pub fn stop_s(&self) -> f64 {
        let most = &self.reference.limits().acceleration_rad_per_s2;
        let qd = &self.reference.state().qd.0;
        let each = qd.iter().zip(most).map(|(qd, most)| qd.abs() / most);
        each.fold(0.0, f64::max)
    }

    /// Are all joints within the share of the speeds that was set last, and does the motion go as slowly as it asks for?
    #[must_use]
    pub fn has_slowed(&self) -> bool {
        if !self.reference.has_slowed_on_way() {
            return false;
        }
        let share = self.reference.speed_share() * (1.0 + SLOWED);
        let most = &self.reference.limits().velocity_rad_per_s;
        let qd = &self.reference.state().qd.0;
        qd.iter().zip(most).all(|(v, most)| v.abs() <= share * most)
    }

    /// The next configuration on the way to the goal, `dt_s` later. Without a goal it brakes.
    ///
    /// # Errors
    /// A step that is negative, NaN or infinite; nothing then moves.
    pub fn step(&mut self, dt_s: f64) -> Result<JointPositions, HapticsError> {
        non_negative("dt_s", dt_s)?;
        self.end_slide();
        self.route.begin_step();
        match &self.destination {
            Some(destination) => {
                let is_bent = self.reference.by_way_of().is_some();
                let due = self.route.is_retry_due(dt_s, is_bent);
                let stands = self.reference.goal().is_none() && !self.route.is_blocked();
                self.since_plan_s += dt_s;
                let drifted = self.has_drifted && self.since_plan_s >= DRIFT_S;
                // A search that began anew with every drift and every change of speed might never end; one for another place is of no
                // use.
                let goes_on = self.route.is_searching_for(destination);
                let is_obsolete = self.route.is_searching() && !goes_on;
                let is_new = self.is_to_plan || stands || drifted || is_obsolete;
                let (reference, solver) = (&mut self.reference, &mut self.goals.solver);
                let planned = if goes_on {
                    self.route.search_on(reference, solver)
                } else if is_new || due {
                    (self.is_to_plan, self.has_drifted, self.since_plan_s) = (false, false, 0.0);
                    self.route.head_for(destination, is_new, reference, solver)
                } else {
                    Ok(())
                };
                if planned.is_err() {
                    // No motion was found: the one under way ends, and from further on there may be one.
                    self.route.block();
                }
            }
            None => self.reference.brake(),
        }
        let q = self.reference.step(dt_s)?.q;
        Ok(self.legal(q))
    }

    /// The configuration within the limits of the arm: braking from a state that came too fast to stop before a limit passes it.
    fn legal(&self, q: JointPositions) -> JointPositions {
        let limits = self.arm().limits();
        JointPositions(std::array::from_fn(|i| {
            q[i].clamp(limits[i].min_rad, limits[i].max_rad)
        }))
    }

    /// The next configuration while coming to rest as fast as the limits allow; the goal is kept.
    ///
    /// # Errors
    /// As for [`Follower::step`].
    pub fn brake(&mut self, dt_s: f64) -> Result<JointPositions, HapticsError> {
        non_negative("dt_s", dt_s)?;
        // By the time that it went on, the board would be elsewhere.
        self.route.end_search();
        let ends_slide = self.ends_slide || self.sliding.is_some();
        self.end_slide();
        if ends_slide {
            self.brake_together(dt_s)?;
            return Ok(self.commanded());
        }
        self.reference.brake();
        let q = self.reference.step(dt_s)?.q;
        Ok(self.legal(q))
    }

    /// All joints lose the same share of their speeds, the slowest to stop as fast as it can: the board goes on the way that it
    /// was going, and ends there. Joints that each stopped as soon as they could would make it swing back.
    fn brake_together(&mut self, dt_s: f64) -> Result<(), HapticsError> {
        let mut state = *self.reference.state();
        let fastest = state
            .qd
            .0
            .iter()
            .fold(0.0, |most: f64, qd| most.max(qd.abs()));
        let hardest_s = (state.qd.0.iter().zip(&self.bounds))
            .map(|(qd, bounds)| qd.abs() / bounds.acceleration_rad_per_s2())
            .fold(0.0, f64::max);
        // Gently at the end, as a slide begins: a servo that cannot end a motion at once would swing back.
        let stop_s = hardest_s + ENDS_S;
        state.qdd_rad_per_s2 = [0.0; 7];
        // The mean speed lasts for as long as there is one.
        let (share, lasts_s) = match dt_s < stop_s && fastest > STANDS_RAD_PER_S {
            true => (1.0 - dt_s / stop_s, dt_s),
            false => (0.0, stop_s.min(dt_s)),
        };
        for joint in 0..7 {
            let before = state.qd[joint];
            state.qd[joint] = share * before;
            state.q[joint] += 0.5 * (1.0 + share) * before * lasts_s;
        }
        state.q = self.legal(state.q);
        self.reference.restart(&state)?;
        self.ends_slide = share > 0.0;
        Ok(())
    }

    fn end_slide(&mut self) {
        if self.sliding.take().is_some() {
            self.is_to_plan = true;
            self.route.end_search();
        }
        (self.ends_slide, self.blocked) = (false, None);
    }
}

impl Follower {
    /// The next configuration while the board moves within its plane; the first call starts where braking
    /// would have left it. Returns why the board cannot go on, if it cannot; it then comes to
    /// rest and waits for another direction.
    ///
    /// The velocity changes no faster than the joints can, so that they follow without lag and without
    /// overshoot. A call for any other motion ends the slide.
    ///
    /// # Errors
    /// NaN or infinity in the slide, or a step as for [`Follower::step`]; nothing then moves.
    pub fn slide(&mut self, dt_s: f64, slide: &Slide) -> Result<Option<Unreachable>, HapticsError> {
        slide.validate()?;
        non_negative("dt_s", dt_s)?;
        let blocked = self.blocked.filter(|(blocked, _)| slide.goes_on(blocked));
        let next = match blocked {
            Some((_, reason)) => Err(Stop::Unreachable(reason)),
            None => {
                let sliding = self.sliding.unwrap_or_else(|| self.at_rest());
                sliding.next(dt_s, slide, &self.bounds, &mut self.goals.solver)
            }
        };
        match next {
            Ok(next) => {
                let (q, rate) = (next.sliding.q(), next.rate_rad_per_s);
                self.advance_beside(dt_s, &q, &rate)?;
                (self.sliding, self.blocked) = (Some(next.sliding), None);
                self.ends_slide = false;
                Ok(next.unreachable)
            }
            Err(Stop::Unreachable(reason)) => {
                self.brake(dt_s)?;
                self.blocked = Some((*slide, reason));
                Ok(Some(reason))
            }
            Err(Stop::Error(error)) => Err(error),
        }
    }

    /// Every joint beside a moving goal.
    fn advance_beside(
        &mut self,
        dt_s: f64,
        q: &JointPositions,
        rate_rad_per_s: &[f64; 7],
    ) -> Result<(), HapticsError> {
        let limits = *self.arm().limits();
        let mut state = *self.reference.state();
        state.qdd_rad_per_s2 = [0.0; 7];
        for (joint, limit) in limits.iter().enumerate() {
            let before = state.q[joint];
            let motion = JointMotion {
                q_rad: before,
                qd_rad_per_s: state.qd[joint],
            };
            let next = motion.beside(q[joint], rate_rad_per_s[joint], &self.bounds[joint], dt_s);
            // Rounding may leave a limit by an ulp; a start outside the limits stays legal.
            let (least, most) = (limit.min_rad.min(before), limit.max_rad.max(before));
            state.q[joint] = next.q_rad.clamp(least, most);
            state.qd[joint] = next.qd_rad_per_s;
        }
        self.reference.restart(&state)?;
        Ok(())
    }

    /// The acceleration along a direction that all joints allow a board at its goal, m/s²; `None` without
    /// a goal or a direction, or where the board cannot move that way.
    ///
    /// Error: that of a difference over 0.1 mm, about 1e-3 of the value away from singular poses.
    #[must_use]
    pub fn acceleration_along_m_per_s2(&mut self, direction: DVec3) -> Option<f64> {
        let q = self.goal()?;
        let at = Sliding::new(self.arm().forward(&q), q);
        at.acceleration_along_m_per_s2(direction, &self.bounds, &mut self.goals.solver)
    }

    /// A slide that begins where braking ends.
    fn at_rest(&self) -> Sliding {
        let state = self.reference.state();
        let q = JointPositions(std::array::from_fn(|i| {
            let limit = self.arm().limits()[i];
            let motion = JointMotion {
                q_rad: state.q[i],
                qd_rad_per_s: state.qd[i],
            };
            let stop = motion.stopping_point_rad(&self.bounds[i]);
            stop.clamp(limit.min_rad, limit.max_rad)
        }));
        Sliding::new(self.arm().forward(&q), q)
    }
}
