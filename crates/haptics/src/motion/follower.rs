//! From targets of the board to joint commands within the arm's limits.

mod slides;

use super::approach_config::ApproachConfig;
use super::barrier::links::LinkInFront;
use super::barrier::tree::BarrierTree;
use super::follower_config::FollowerConfig;
use super::goal;
use super::goals::Goals;
use super::link::{Aim, Answer, Asked, Link};
use super::planner::Planner;
use super::profile::JointBounds;
use super::route::Route;
use super::slide::{Slide, Sliding};
use super::solver::Solver;
use crate::board::{Board, BoardTarget};
use crate::body::{PersonBody, Separation};
use crate::error::HapticsError;
use hwall_geometry::Pose;
use hwall_kinematics::{ArmKinematics, JointPositions, JointVelocities, Twist, Unreachable};
use hwall_motion::{JointState, MotionLimits, ReferenceMotion};
use hwall_numeric::check::{all_finite, non_negative, that};
use std::sync::Arc;

/// Relative rounding error of a speed.
const SLOWED: f64 = 1e-3;

/// Brings the board to its target: executes the motion that a [`Planner`] has found, and can end it at any time.
///
/// A step continues a motion whose end is known, and asks the planner for the next one; a later step begins what the planner has found. Until
/// [`take_planner`](Self::take_planner) the follower owns its planner, and [`plan`](Self::plan), called between two steps, runs it.
///
/// The goal configuration comes from the arm's inverse kinematics, analytic or numeric. While a target drifts, the goal keeps its branch, roll and
/// neighbourhood. For a new or distant target the follower takes the roll that it reaches soonest, close to the configuration that the target names
/// or on the present branch. The joints then arrive together, jerk-limited and in the least time ([`ReferenceMotion`]), behind the surfaces if a
/// board and barriers are given.
///
/// For an arm that [searches](ArmKinematics::searches), each roll first gets a descent from the commanded joints. If all fail, each call of
/// [`Planner::plan`] searches one roll, so that a call stays below about a millisecond for a UR5 or a Panda, also while an unreachable target drifts.
#[derive(Debug)]
pub struct Follower {
    /// Inverse kinematics for slides.
    solver: Solver,
    /// A target further than this from the last one counts as new, m and rad.
    far: [f64; 2],
    reference: ReferenceMotion,
    /// Bounds for slides, without a jerk limit.
    bounds: [JointBounds; 7],
    asked: Asked,
    answer: Answer,
    /// The answer's plan has not begun yet.
    is_pending: bool,
    /// An answer was taken since the last step.
    has_heard: bool,
    link: Link,
    planner: Option<Box<Planner>>,
    sliding: Option<Sliding>,
    /// The slide is over, but its joints are still coming to rest.
    ends_slide: bool,
    /// The slide that had to end, and why: a new slide in the same direction stays blocked.
    blocked: Option<(Slide, Unreachable)>,
}

impl Follower {
    /// A link that is in front of a surface and within reach of [the person](Self::set_person), at the planner's last check. `None` without
    /// [`keep_clear`](Self::keep_clear).
    #[must_use]
    pub const fn link_in_front(&self) -> Option<LinkInFront> {
        self.answer.link_in_front
    }

    /// A follower at rest at `start`, for an arm whose tool frame is the board's face
    /// ([`Board::flange_from_board_face`](crate::Board::flange_from_board_face)).
    ///
    /// # Errors
    /// As for [`FollowerConfig::validate`]; a motion limit outside its range; a start that is not finite.
    pub fn new(
        arm: Arc<dyn ArmKinematics>,
        config: FollowerConfig,
        start: &JointPositions,
    ) -> Result<Self, HapticsError> {
        config.validate()?;
        let limits = MotionLimits::of_arm(&*arm, &config.motion)?;
        let bounds = std::array::from_fn(|joint| JointBounds {
            velocity_rad_per_s: limits.velocity_rad_per_s[joint],
            acceleration_rad_per_s2: limits.acceleration_rad_per_s2[joint],
        });
        let motion = || ReferenceMotion::new(&*arm, &limits, start);
        let (solver, link) = (Solver::new(Arc::clone(&arm)), Link::default());
        let goals = Goals::new(solver.clone(), &config);
        let route = Route::new(config.approach, None);
        let planner = Planner::new(link.clone(), goals, route, motion()?);
        Ok(Self {
            solver,
            far: [config.far_m, config.far_rad],
            reference: motion()?,
            bounds,
            asked: Asked::default(),
            answer: Answer::default(),
            is_pending: false,
            has_heard: false,
            link,
            planner: Some(Box::new(planner)),
            sliding: None,
            ends_slide: false,
            blocked: None,
        })
    }

    /// Adds a board of this size, which stays behind the surface that it serves, the one that it served before, and the barriers of
    /// [`set_barriers`](Self::set_barriers).
    #[must_use]
    pub fn with_board(mut self, config: ApproachConfig, board: Board) -> Self {
        if let Some(planner) = &mut self.planner {
            *planner.route_mut() = Route::new(config, Some(board));
        }
        self
    }

    /// From now on paths keep clear of the arm itself, of the room and of [the person](Self::set_person) where possible: an arm that is already too
    /// close comes no closer. A path is checked at 12 to 48 samples; the supervisor is responsible for what lies between them.
    pub fn keep_clear(&mut self, separation: Separation) {
        if let Some(planner) = &mut self.planner {
            planner.keep_clear(separation);
        }
    }

    /// Sets the last known position of the person.
    pub const fn set_person(&mut self, person: PersonBody) {
        self.asked.person = person;
    }

    /// Sets the configuration in which the arm is known to be free, see [`Separation::fit`].
    pub const fn set_began(&mut self, began: Option<JointPositions>) {
        self.asked.began = began;
    }

    /// Runs the follower's own planner, between two steps; see [`Planner::plan`].
    pub fn plan(&mut self) -> bool {
        self.planner.as_mut().is_some_and(|planner| planner.plan())
    }

    /// Hands over the planner, to run on its own thread.
    pub fn take_planner(&mut self) -> Option<Planner> {
        self.planner.take().map(|planner| *planner)
    }

    /// Sets surfaces to stay behind, besides the one served. After [`take_planner`](Self::take_planner), set them on the planner
    /// instead.
    pub fn set_barriers(&mut self, barriers: impl Into<BarrierTree>) {
        if let Some(planner) = &mut self.planner {
            planner.set_barriers(barriers);
        }
    }

    /// The step that the planner's newest answer refers to, and the number of the surfaces used, for the log; zeros before the first answer.
    #[must_use]
    pub const fn planned(&self) -> [u64; 2] {
        [self.answer.to, self.answer.surfaces]
    }

    /// Does the planner know the surfaces?
    #[must_use]
    pub const fn knows_surfaces(&self) -> bool {
        self.answer.knows_surfaces
    }

    /// How far the corners or the centre of the face were in front of a surface at the planner's last check, m; negative behind all of them. Around
    /// the goal only its own surface counts. `None` without a board or barriers.
    #[must_use]
    pub const fn protrusion_m(&self) -> Option<f64> {
        self.answer.protrusion_m
    }

    /// Forgets target and goal and continues from a measured state, no faster than the limits.
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
            let most = bounds.velocity_rad_per_s;
            state.qd[joint] = qd[joint].clamp(-most, most);
        }
        self.reference.restart(&state)?;
        self.asked.counts.forgets += 1;
        self.asked.aim = Aim::Nowhere;
        (self.answer.destination, self.answer.is_blocked) = (None, false);
        self.refuse();
        self.end_slide();
        Ok(())
    }

    /// Sets the target of the board. Repeating the last target costs nothing.
    ///
    /// Returns why the board cannot reach the target, if the planner found that it cannot; the last goal is then kept. Until the planner has handled
    /// this target, or one close to it, returns `None`.
    ///
    /// # Errors
    /// NaN, infinity or a normal without a direction; the last goal is then kept too.
    pub fn set_target(
        &mut self,
        target: &BoardTarget,
    ) -> Result<Option<Unreachable>, HapticsError> {
        goal::validate(target)?;
        self.hear();
        self.asked.aim = Aim::Target(*target);
        let [far_m, far_rad] = self.far;
        let answered = self.answer.target.is_some_and(|looked_at| {
            looked_at.point_m.distance(target.point_m) <= far_m
                && looked_at.normal.angle_between(target.normal) <= far_rad
        });
        Ok(self.answer.unreachable.filter(|_| answered))
    }

    /// Sets a target and runs the planner on it at once, for callers without a control loop.
    ///
    /// # Errors
    /// As for [`set_target`](Self::set_target).
    pub fn aim(&mut self, target: &BoardTarget) -> Result<Option<Unreachable>, HapticsError> {
        self.set_target(target)?;
        // Ask, plan, begin.
        self.step(0.0)?;
        self.plan();
        self.step(0.0)?;
        self.set_target(target)
    }

    /// Sets a goal posture regardless of the board's pose; the target is forgotten. `prepositions_to`: from that posture the arm moves towards this
    /// configuration as far as the board stays behind the surfaces, at most two fifths of the path.
    ///
    /// # Errors
    /// NaN, infinity, or a posture outside the joint limits; the last goal is then kept.
    pub fn set_posture(
        &mut self,
        q: &JointPositions,
        prepositions_to: Option<&JointPositions>,
    ) -> Result<(), HapticsError> {
        let aim = Aim::Posture {
            q: *q,
            prepositions_to: prepositions_to.copied(),
        };
        self.hear();
        if self.asked.aim == aim {
            return Ok(());
        }
        for q in std::iter::once(q).chain(prepositions_to) {
            all_finite("posture", &q.0)?;
            for (joint, limit) in self.arm().limits().iter().enumerate() {
                let valid = limit.contains(q[joint]);
                that(valid, "posture", q[joint], "within the joint limits")?;
            }
        }
        self.asked.aim = aim;
        Ok(())
    }

    /// The goal configuration, rad; `None` before the first reachable target or posture.
    #[must_use]
    pub fn goal(&self) -> Option<JointPositions> {
        self.answer.destination
    }

    /// Time until the board is at its goal, s. On a detour: at least the time until the detour ends. While a path is still being searched for: the
    /// joints' least time. `None` without a goal.
    #[must_use]
    pub fn left_s(&self) -> Option<f64> {
        let destination = &self.answer.destination?;
        let is_under_way = self.reference.goal() == Some(destination);
        if self.answer.is_searching_anew && !is_under_way && !self.is_detour() {
            return Some(self.reference.least_time_to_s(destination));
        }
        let left_s = self.reference.left_s();
        let detour_s = match self.reference.goal() {
            Some(goal) if goal == destination => 0.0,
            Some(ends) => self.reference.limits().travel_time_s(ends, destination),
            None if self.is_blocked() => {
                let here = &self.reference.state().q;
                self.reference.limits().travel_time_s(here, destination)
            }
            // Planning is due.
            None => 0.0,
        };
        Some(left_s + detour_s)
    }

    /// Least time until all joints could rest at a configuration, s, each joint on its own, regardless of surfaces.
    #[must_use]
    pub fn least_time_to_s(&self, q: &JointPositions) -> f64 {
        self.reference.least_time_to_s(q)
    }

    /// Is the board on its way to a detour point behind the surfaces, from which it continues to its goal?
    #[must_use]
    pub const fn is_detour(&self) -> bool {
        self.answer.is_detour
    }

    /// Did the last complete search find no path to the goal behind the surfaces? The board then completes its current motion and stands still.
    #[must_use]
    pub const fn is_blocked(&self) -> bool {
        self.answer.is_blocked
    }

    /// Number of samples of candidate paths that the planner checked in its last answered call: usually none, never more than
    /// [`PlannerConfig::samples`](super::PlannerConfig::samples) plus [`Planner::MOST_SAMPLES`]. A longer search continues in the next call while the
    /// current motion continues; it restarts for a target that jumps or changes its distance behind the surface, and after braking. Plans and inverse
    /// kinematics count as the samples that take about as long.
    #[must_use]
    pub const fn samples(&self) -> usize {
        self.answer.samples
    }

    /// How many barrier rectangles, and boxes around them, those checks tested.
    #[must_use]
    pub const fn tests(&self) -> usize {
        self.answer.tests
    }

    /// The configuration that the motion still has to pass to stay behind the surfaces, rad.
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

    /// Pose and velocity of the face at the configuration commanded last.
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
        self.solver.arm()
    }

    /// Sets the share of the joint speeds that may be used, in (0, 1]. A faster motion slows down along its path, so that it stays behind the
    /// surfaces; if the share allows more speed than planned, another path is sought.
    ///
    /// # Errors
    /// A share outside its range; the last one is then kept.
    pub fn set_speed_share(&mut self, share: f64) -> Result<(), HapticsError> {
        Ok(self.reference.set_speed_share_on_way(share)?)
    }

    /// The share of the joint speeds that the current motion uses at present: after [`set_speed_share`](Self::set_speed_share) slowing down takes a
    /// while.
    #[must_use]
    pub fn present_share(&self) -> f64 {
        let is_under_way = self.reference.goal().is_some() && self.reference.left_s() > 0.0;
        if !is_under_way {
            return self.reference.speed_share();
        }
        let most = &self.reference.limits().velocity_rad_per_s;
        let qd = &self.reference.state().qd.0;
        // A motion planned with a smaller share begins at the speed of the previous one.
        let fastest = qd.iter().zip(most).map(|(v, most)| v.abs() / most);
        fastest
            .fold(self.reference.present_share(), f64::max)
            .min(1.0)
    }

    /// The least time in which all joints come to rest together, s.
    #[must_use]
    pub fn stop_s(&self) -> f64 {
        self.limits().stop_s(&self.reference.state().qd)
    }

    /// Are all joints within the last set share of the speeds, and has the motion slowed to it?
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

    /// The next configuration on the path to the goal, `dt_s` later. Without a goal the arm brakes.
    ///
    /// # Errors
    /// A step that is negative, NaN or infinite; nothing then moves.
    pub fn step(&mut self, dt_s: f64) -> Result<JointPositions, HapticsError> {
        non_negative("dt_s", dt_s)?;
        self.end_slide();
        self.hear();
        let left_s = self.begin_plan(dt_s)?;
        if self.answer.destination.is_none() {
            self.reference.brake();
        }
        let q = self.reference.step(left_s)?.q;
        self.ask(dt_s, true);
        Ok(self.legal(q))
    }

    /// Takes the planner's answer at most once a step: the log names one answer for each step.
    fn hear(&mut self) {
        if self.has_heard || !self.link.take_answer(&mut self.answer) {
            return;
        }
        self.has_heard = true;
        self.is_pending = self.answer.moves;
        // The answer belongs to a motion that has been forgotten since.
        let (known, counts) = (self.answer.counts, self.asked.counts);
        if known.forgets != counts.forgets {
            self.answer.destination = None;
        }
        if known != counts {
            self.refuse();
        }
    }

    /// Drops the waiting plan.
    const fn refuse(&mut self) {
        if self.is_pending {
            self.asked.answered = self.answer.motion.number();
            self.is_pending = false;
        }
    }

    /// Begins the waiting plan if its time has come. Returns the rest of the step, s.
    fn begin_plan(&mut self, dt_s: f64) -> Result<f64, HapticsError> {
        if !self.is_pending {
            return Ok(dt_s);
        }
        let begins_in_s = self.reference.begins_in_s(&self.answer.motion);
        match begins_in_s.map(|s| s.min(dt_s)) {
            Some(_) if begins_in_s > Some(dt_s * (1.0 + 1e-9)) => Ok(dt_s),
            Some(until_s) => {
                if until_s > 0.0 {
                    self.reference.step(until_s)?;
                }
                self.reference.take(&mut self.answer.motion);
                self.refuse();
                Ok(dt_s - until_s)
            }
            None => {
                self.refuse();
                Ok(dt_s)
            }
        }
    }

    /// Sends the planner the state after a step.
    fn ask(&mut self, dt_s: f64, goes: bool) {
        self.asked.number += 1;
        self.asked.clock_s += dt_s;
        (self.asked.dt_s, self.asked.goes) = (dt_s, goes);
        self.asked.under_way = self.reference.under_way();
        self.has_heard = false;
        self.link.ask(&self.asked);
    }

    /// Clamps a configuration to the joint limits: braking from a state too fast to stop before a limit would pass it.
    fn legal(&self, q: JointPositions) -> JointPositions {
        let limits = self.arm().limits();
        JointPositions(std::array::from_fn(|i| {
            q[i].clamp(limits[i].min_rad, limits[i].max_rad)
        }))
    }
}
