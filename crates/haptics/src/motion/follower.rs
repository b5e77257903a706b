//! From a moving board target to joint commands within the arm's limits.

use super::profile::{JointBounds, JointMotion};
use super::slide::{Slide, Sliding};
use super::solver::{DRIFT_RAD, Place, Solver, Stop};
use crate::board::{BoardTarget, QUARTER_TURNS_RAD};
use crate::error::HapticsError;
use glam::DVec3;
use hwall_geometry::direction;
use hwall_kinematics::{
    ArmKinematics, ArmSolution, BranchPolicy, JointPositions, JointVelocities, Unreachable,
};
use hwall_numeric::check::{all_finite, non_negative, positive, that};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Settings of [`Follower`].
#[derive(Debug, Clone, PartialEq)]
pub struct FollowerConfig {
    /// Share of the arm's joint speeds that is used, in (0, 1]; default 0.9, which leaves room for the
    /// arm's own servo to catch up.
    pub speed_share: f64,
    /// Largest joint acceleration, rad/s²; default 10 for every joint. An assumption: the data
    /// sheet states none.
    pub acceleration_rad_per_s2: [f64; 7],
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
            speed_share: 0.9,
            acceleration_rad_per_s2: [10.0; 7],
            rolls_rad: QUARTER_TURNS_RAD.to_vec(),
            far_m: 0.05,
            far_rad: 0.2,
        }
    }
}

impl FollowerConfig {
    /// Rejects settings outside their ranges and an empty list of rolls.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("speed_share", self.speed_share)?;
        that(
            self.speed_share <= 1.0,
            "speed_share",
            self.speed_share,
            "at most 1",
        )?;
        for acceleration in self.acceleration_rad_per_s2 {
            positive("acceleration_rad_per_s2", acceleration)?;
        }
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

/// What the follower last worked out for a target.
#[derive(Debug, Clone, Copy)]
struct Aim {
    point_m: DVec3,
    normal: DVec3,
    roll_rad: Option<f64>,
    unit_normal: DVec3,
    unreachable: Option<Unreachable>,
    /// Rolls that wait for their search; until none is left, the target is not known to be unreachable.
    unsearched: usize,
}

/// A configuration that puts the board on a target.
#[derive(Debug, Clone, Copy)]
struct Goal {
    q: JointPositions,
    roll_rad: f64,
    point_m: DVec3,
    normal: DVec3,
}

/// Follows a board target with the arm's joints.
///
/// The goal configuration comes from the inverse kinematics of the arm, closed or numeric. While a target
/// drifts, branch, roll and neighbourhood of the goal are kept; for a new target, or one that is far away, the
/// roll is taken that the commanded joints reach soonest, on their present branch if that can hold it. Then each
/// joint moves there by itself, time-optimally within velocity and acceleration limits, without overshoot.
///
/// An arm that [searches](ArmKinematics::searches) is asked for a descent from the commanded joints for each roll; where
/// all fail, one roll is searched in each call of [`set_target`](Self::set_target), so that a step stays below about a
/// millisecond for a UR5 or a Panda, also while an unreachable target drifts.
#[derive(Debug, Clone)]
pub struct Follower {
    solver: Solver,
    config: FollowerConfig,
    bounds: [JointBounds; 7],
    motion: [JointMotion; 7],
    aim: Option<Aim>,
    goal: Option<Goal>,
    sliding: Option<Sliding>,
    /// The direction in which a slide had to end, and why.
    blocked: Option<(DVec3, Unreachable)>,
    /// Which of the rolls is searched next.
    turn: usize,
}

impl Follower {
    /// A follower at rest at `start`, for an arm whose tool frame is the board's face
    /// ([`Board::flange_from_board_face`](crate::Board::flange_from_board_face)).
    ///
    /// # Errors
    /// As for [`FollowerConfig::validate`]; an arm with a joint speed that is not positive; a
    /// start that is not finite.
    pub fn new(
        arm: Arc<dyn ArmKinematics>,
        config: FollowerConfig,
        start: &JointPositions,
    ) -> Result<Self, HapticsError> {
        config.validate()?;
        for speed in *arm.max_velocity_rad_per_s() {
            positive("max_velocity_rad_per_s", speed)?;
        }
        let mut bounds = [JointBounds::new(1.0, 1.0)?; 7];
        for (joint, bounds) in bounds.iter_mut().enumerate() {
            let velocity_rad_per_s = config.speed_share * arm.max_velocity_rad_per_s()[joint];
            *bounds = JointBounds::new(velocity_rad_per_s, config.acceleration_rad_per_s2[joint])?;
        }
        let motion = [JointMotion::at_rest(0.0); 7];
        let mut follower = Self {
            solver: Solver::new(arm),
            config,
            bounds,
            motion,
            aim: None,
            goal: None,
            sliding: None,
            blocked: None,
            turn: 0,
        };
        follower.restart(start, &JointVelocities::default())?;
        Ok(follower)
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
        for (joint, motion) in self.motion.iter_mut().enumerate() {
            let most = self.bounds[joint].velocity_rad_per_s();
            *motion = JointMotion {
                q_rad: q[joint],
                qd_rad_per_s: qd[joint].clamp(-most, most),
            };
        }
        (self.aim, self.goal) = (None, None);
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
        let BoardTarget {
            point_m,
            normal,
            roll_rad,
            ..
        } = *target;
        let same =
            |aim: &Aim| aim.point_m == point_m && aim.normal == normal && aim.roll_rad == roll_rad;
        if let Some(aim) = self.aim.filter(|aim| same(aim) && aim.unsearched == 0) {
            return Ok(aim.unreachable);
        }
        all_finite("point_m", &point_m.to_array())?;
        all_finite("roll_rad", roll_rad.as_slice())?;
        let unit_normal = direction("normal", normal)?;
        let drifted = match self.goal {
            Some(goal) if self.is_near((goal.point_m, goal.normal), (point_m, unit_normal)) => {
                let kept = roll_rad.map_or(goal.roll_rad, |roll| same_face(roll, goal.roll_rad));
                let place = Place {
                    point_m,
                    normal: unit_normal,
                    roll_rad: kept,
                };
                let found = self
                    .solver
                    .on_place(&place, &goal.q, BranchPolicy::Keep)?
                    .ok();
                found
                    .filter(|solution| solution.q.max_abs_difference(&goal.q) <= DRIFT_RAD)
                    .map(|solution| (solution, kept))
            }
            _ => None,
        };
        let mut unsearched = 0;
        let (found, unreachable) = match drifted {
            Some(found) => (Some(found), None),
            None => {
                let here = self.commanded();
                let place = |roll_rad| Place {
                    point_m,
                    normal: unit_normal,
                    roll_rad,
                };
                let both;
                let rolls_rad = match roll_rad {
                    Some(roll) => {
                        both = [roll, roll + PI];
                        &both[..]
                    }
                    None => &self.config.rolls_rad,
                };
                let places = rolls_rad.iter().map(|roll| place(*roll));
                if self.arm().searches() {
                    let one = place(rolls_rad[self.turn % rolls_rad.len()]);
                    unsearched = match self.aim {
                        Some(aim) if self.is_failing(&aim, (point_m, unit_normal)) => {
                            aim.unsearched
                        }
                        _ => rolls_rad.len(),
                    };
                    let (solver, bounds) = (&mut self.solver, &self.bounds);
                    let beside = soonest(solver, bounds, &here, places, BranchPolicy::Keep)?;
                    match beside {
                        (None, Some(Unreachable::NotFound { .. })) => {
                            self.turn = self.turn.wrapping_add(1);
                            unsearched = unsearched.saturating_sub(1);
                            let one = std::iter::once(one);
                            soonest(solver, bounds, &here, one, BranchPolicy::Prefer)?
                        }
                        // Found, or proven.
                        known => {
                            unsearched = 0;
                            known
                        }
                    }
                } else {
                    let (solver, bounds) = (&mut self.solver, &self.bounds);
                    soonest(solver, bounds, &here, places, BranchPolicy::Prefer)?
                }
            }
        };
        if found.is_some() {
            unsearched = 0;
        }
        let unreachable = unreachable.filter(|_| unsearched == 0);
        if let Some((solution, roll_rad)) = found {
            self.goal = Some(Goal {
                q: solution.q,
                roll_rad,
                point_m,
                normal: unit_normal,
            });
        }
        self.aim = Some(Aim {
            point_m,
            normal,
            roll_rad,
            unit_normal,
            unreachable,
            unsearched,
        });
        Ok(unreachable)
    }

    /// The goal configuration, rad, if a reachable target was ever set.
    #[must_use]
    pub fn goal(&self) -> Option<JointPositions> {
        self.goal.map(|goal| goal.q)
    }

    /// The configuration commanded last, rad.
    #[must_use]
    pub fn commanded(&self) -> JointPositions {
        JointPositions(self.motion.map(|motion| motion.q_rad))
    }

    /// The velocity at the configuration commanded last, rad/s.
    #[must_use]
    pub fn commanded_velocity(&self) -> JointVelocities {
        JointVelocities(self.motion.map(|motion| motion.qd_rad_per_s))
    }

    /// The arm with the board as its tool.
    #[must_use]
    pub const fn arm(&self) -> &Arc<dyn ArmKinematics> {
        self.solver.arm()
    }

    /// The next configuration on the way to the goal, `dt_s` later. Without a goal it brakes.
    ///
    /// # Errors
    /// A step that is negative, NaN or infinite; nothing then moves.
    pub fn step(&mut self, dt_s: f64) -> Result<JointPositions, HapticsError> {
        self.end_slide();
        let goal = self.goal;
        self.advance(dt_s, |joint, motion, bounds| match goal {
            Some(goal) => motion.towards(goal.q[joint], bounds, dt_s),
            None => motion.braked(bounds, dt_s),
        })
    }

    /// The next configuration while coming to rest as fast as the limits allow; the goal is kept.
    ///
    /// # Errors
    /// As for [`Follower::step`].
    pub fn brake(&mut self, dt_s: f64) -> Result<JointPositions, HapticsError> {
        self.end_slide();
        self.advance(dt_s, |_, motion, bounds| motion.braked(bounds, dt_s))
    }

    const fn end_slide(&mut self) {
        (self.sliding, self.blocked) = (None, None);
    }

    fn advance(
        &mut self,
        dt_s: f64,
        next: impl Fn(usize, JointMotion, &JointBounds) -> JointMotion,
    ) -> Result<JointPositions, HapticsError> {
        non_negative("dt_s", dt_s)?;
        let limits = *self.arm().limits();
        for (joint, motion) in self.motion.iter_mut().enumerate() {
            let before = motion.q_rad;
            *motion = next(joint, *motion, &self.bounds[joint]);
            // Rounding may leave a limit by an ulp; a start outside the limits stays legal.
            let limit = limits[joint];
            motion.q_rad = motion
                .q_rad
                .clamp(limit.min_rad.min(before), limit.max_rad.max(before));
        }
        Ok(self.commanded())
    }

    /// Two points with unit normals.
    fn is_near(&self, a: (DVec3, DVec3), b: (DVec3, DVec3)) -> bool {
        a.0.distance(b.0) <= self.config.far_m && a.1.angle_between(b.1) <= self.config.far_rad
    }

    /// Is this the last aim, drifted, for which nothing was found so far?
    fn is_failing(&self, aim: &Aim, place: (DVec3, DVec3)) -> bool {
        (aim.unsearched > 0 || aim.unreachable.is_some())
            && self.is_near((aim.point_m, aim.unit_normal), place)
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
        let way = slide.velocity_m_per_s;
        let blocked = self.blocked.filter(|(blocked, _)| blocked.dot(way) > 0.0);
        let next = match blocked {
            Some((_, reason)) => Err(Stop::Unreachable(reason)),
            None => {
                let sliding = self.sliding.unwrap_or_else(|| self.at_rest());
                sliding.next(dt_s, slide, &self.bounds, &mut self.solver)
            }
        };
        match next {
            Ok(next) => {
                let (q, rate) = (next.sliding.q(), next.rate_rad_per_s);
                self.advance(dt_s, |joint, motion, bounds| {
                    motion.beside(q[joint], rate[joint], bounds, dt_s)
                })?;
                (self.sliding, self.blocked) = (Some(next.sliding), None);
                Ok(next.unreachable)
            }
            Err(Stop::Unreachable(reason)) => {
                self.brake(dt_s)?;
                self.blocked = Some((way, reason));
                Ok(Some(reason))
            }
            Err(Stop::Error(error)) => Err(error),
        }
    }

    /// The acceleration along a direction that all joints allow a board at its goal, m/s²; `None` without
    /// a goal or a direction, or where the board cannot move that way.
    ///
    /// Error: that of a difference over 0.1 mm, about 1e-3 of the value away from singular poses.
    #[must_use]
    pub fn acceleration_along_m_per_s2(&mut self, direction: DVec3) -> Option<f64> {
        let q = self.goal()?;
        let at = Sliding::new(self.arm().forward(&q), q);
        at.acceleration_along_m_per_s2(direction, &self.bounds, &mut self.solver)
    }

    /// A slide that begins where braking ends.
    fn at_rest(&self) -> Sliding {
        let q = JointPositions(std::array::from_fn(|i| {
            let limit = self.arm().limits()[i];
            let stop = self.motion[i].stopping_point_rad(&self.bounds[i]);
            stop.clamp(limit.min_rad, limit.max_rad)
        }));
        Sliding::new(self.arm().forward(&q), q)
    }
}

/// The place that the joints reach soonest; if none can be held, the reason for the first one.
///
/// With [`BranchPolicy::Prefer`] the branch is changed only where a place needs it. A search of all eight branches takes
/// ten times as long, too long for a control step, and shortens the travel by a fifth
/// (random targets and starts over the whole workspace).
fn soonest(
    solver: &mut Solver,
    bounds: &[JointBounds; 7],
    here: &JointPositions,
    places: impl Iterator<Item = Place>,
    policy: BranchPolicy,
) -> Result<Found, HapticsError> {
    let mut best: Option<(ArmSolution, f64)> = None;
    let mut best_s = f64::INFINITY;
    let mut reason = None;
    for place in places {
        match solver.on_place(&place, here, policy)? {
            Ok(solution) => {
                let time_s = travel_time_s(bounds, here, &solution.q);
                if time_s < best_s {
                    (best, best_s) = (Some((solution, place.roll_rad)), time_s);
                }
            }
            Err(unreachable) => reason = reason.or(Some(unreachable)),
        }
    }
    Ok((best, if best.is_some() { None } else { reason }))
}

/// The time at full speed that the slowest joint needs, s.
fn travel_time_s(bounds: &[JointBounds; 7], from: &JointPositions, to: &JointPositions) -> f64 {
    (0..7).fold(0.0, |most: f64, i| {
        most.max((to[i] - from[i]).abs() / bounds[i].velocity_rad_per_s())
    })
}

/// The roll or the one half a turn further, whichever is nearer to another, rad.
fn same_face(roll_rad: f64, to_rad: f64) -> f64 {
    let away = roll_rad - to_rad;
    to_rad + away - PI * (2.0 * away / TAU).round()
}

/// A solution with its roll, or the reason why the board cannot be held.
type Found = (Option<(ArmSolution, f64)>, Option<Unreachable>);
