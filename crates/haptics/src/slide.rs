//! Motion of a touched board within its own plane.

use crate::error::{finite, non_negative};
use crate::follower::DRIFT_RAD;
use crate::{Follower, HapticsError};
use glam::{DMat3, DVec3};
use hwall_kinematics::{
    BranchPolicy, JointPositions, KinematicsError, NearestConfig, Pose, Unreachable,
};

/// How far a slide is looked ahead for the velocities of the joints, s and m.
const PREVIEW_S: f64 = 1e-3;
const PREVIEW_M: f64 = 1e-4;

/// A slide looks no further ahead for where it could stop, m: 0.1 m/s at 0.5 m/s².
const STOP_M: f64 = 0.01;

/// Share of the joints' accelerations that a slide plans with; the rest holds them on the path, whose
/// curvature in the joints costs some too.
const SLIDE_SHARE: f64 = 0.9;

/// How a touched board shall move within its plane, in the robot base frame.
///
/// The board takes up the velocity as fast as its joints allow and then keeps it; way that it lost
/// meanwhile it does not catch up, because that would need more speed than was asked for. The turn counts
/// from any one angle; only its change since the first step of the contact turns the board. Parts along
/// the board's normal are left out: a slide never pushes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Slide {
    /// Velocity, m/s.
    pub velocity_m_per_s: DVec3,
    /// Turn about the outward normal, rad.
    pub turn_rad: f64,
    /// Its rate, rad/s.
    pub turn_rad_per_s: f64,
}

impl Slide {
    /// Rejects NaN and infinities.
    ///
    /// # Errors
    /// The first value that is not finite.
    pub fn validate(&self) -> Result<(), HapticsError> {
        finite("velocity_m_per_s", &self.velocity_m_per_s.to_array())?;
        finite("turn_rad", &[self.turn_rad, self.turn_rad_per_s])
    }
}

/// A slide under way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sliding {
    /// The board where the slide began, and the slide's angle there.
    pose: Pose,
    origin_rad: f64,
    /// The slide's angle now.
    turn_rad: f64,
    /// The board's own way since it began, and its velocity.
    moved_m: DVec3,
    velocity_m_per_s: DVec3,
    /// The configuration that it asked for last.
    q: JointPositions,
}

impl Sliding {
    const fn new(pose: Pose, q: JointPositions, slide: &Slide) -> Self {
        Self {
            pose,
            origin_rad: slide.turn_rad,
            turn_rad: slide.turn_rad,
            moved_m: DVec3::ZERO,
            velocity_m_per_s: DVec3::ZERO,
            q,
        }
    }

    /// A vector's part in the plane of the board.
    fn along(&self, vector: DVec3) -> DVec3 {
        vector.reject_from_normalized(self.pose.rotation().z_axis)
    }

    /// Moves the board on with a change of its velocity.
    fn advance(&mut self, turn_rad: f64, change_m_per_s: DVec3, dt_s: f64) {
        let before = self.velocity_m_per_s;
        self.velocity_m_per_s += change_m_per_s;
        self.moved_m += 0.5 * dt_s * (before + self.velocity_m_per_s);
        self.turn_rad = turn_rad;
    }

    /// The board, further on by this displacement (m) and turn (rad).
    fn place(&self, ahead_m: DVec3, ahead_rad: f64) -> Result<Pose, Stop> {
        let turned = self.turn_rad - self.origin_rad + ahead_rad;
        let rotation = self.pose.rotation() * DMat3::from_rotation_z(turned);
        let along = self.moved_m + ahead_m;
        Pose::new(rotation, self.pose.position_m() + along).map_err(Stop::from)
    }
}

/// Why a slide cannot go on.
enum Stop {
    Unreachable(Unreachable),
    Error(HapticsError),
}

impl From<KinematicsError> for Stop {
    fn from(error: KinematicsError) -> Self {
        match error {
            KinematicsError::Unreachable(reason) => Self::Unreachable(reason),
            other => Self::Error(other.into()),
        }
    }
}

/// A slide one step on.
struct Next {
    sliding: Sliding,
    rate_rad_per_s: [f64; 7],
    /// Why it slows down before the end of its way, if it does.
    unreachable: Option<Unreachable>,
}

impl Follower {
    /// The next configuration while the board moves within its plane, from where braking would have left
    /// it on the first call. Returns why the board cannot go on, if it cannot; it then comes to
    /// rest and waits for another way.
    ///
    /// The velocity changes no faster than the joints can, so that they follow without lag and without
    /// overshoot. A call of any other motion ends the slide.
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
            None => self.slid(dt_s, slide),
        };
        match next {
            Ok(next) => {
                let (q, rate) = (next.sliding.q, next.rate_rad_per_s);
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

    /// The acceleration of a board at its goal along a direction that all joints allow, m/s²; `None` without
    /// a goal or a direction, or where the board cannot move that way.
    ///
    /// Error: that of a difference over 0.1 mm, some 1e-3 of it away from singular poses.
    #[must_use]
    pub fn acceleration_along_m_per_s2(&self, direction: DVec3) -> Option<f64> {
        let q = self.goal()?;
        let at = Sliding::new(self.arm.forward(&q), q, &Slide::default());
        direction.try_normalize()?;
        let able = self.able_m_per_s2(&at, direction).ok()?;
        Some(able / SLIDE_SHARE)
    }

    fn slid(&self, dt_s: f64, slide: &Slide) -> Result<Next, Stop> {
        let sliding = self.sliding.unwrap_or_else(|| self.at_rest(slide));
        let (mut next, mut unreachable) = (sliding, None);
        for wanted in [slide.velocity_m_per_s, DVec3::ZERO] {
            let change = sliding.along(wanted) - sliding.velocity_m_per_s;
            let most = self.able_m_per_s2(&sliding, change)? * dt_s;
            next = sliding;
            next.advance(slide.turn_rad, change.clamp_length_max(most), dt_s);
            match self.stops(&next) {
                Ok(()) => break,
                Err(Stop::Unreachable(reason)) if unreachable.is_none() => {
                    unreachable = Some(reason);
                }
                Err(stop) => return Err(stop),
            }
        }
        let q = self.near(&next.place(DVec3::ZERO, 0.0)?, &sliding.q)?;
        let ahead_m = next.velocity_m_per_s * PREVIEW_S;
        let ahead_rad = slide.turn_rad_per_s * PREVIEW_S;
        let soon = self.near(&next.place(ahead_m, ahead_rad)?, &q)?;
        next.q = q;
        Ok(Next {
            sliding: next,
            rate_rad_per_s: std::array::from_fn(|i| (soon[i] - q[i]) / PREVIEW_S),
            unreachable,
        })
    }

    /// A slide that begins where braking ends.
    fn at_rest(&self, slide: &Slide) -> Sliding {
        let q = JointPositions(std::array::from_fn(|i| {
            let limit = self.arm.limits()[i];
            let stop = self.motion[i].stopping_point_rad(&self.bounds[i]);
            stop.clamp(limit.min_rad, limit.max_rad)
        }));
        Sliding::new(self.arm.forward(&q), q, slide)
    }

    /// The acceleration along a direction that a slide may use, m/s².
    fn able_m_per_s2(&self, sliding: &Sliding, direction: DVec3) -> Result<f64, Stop> {
        let Some(direction) = direction.try_normalize() else {
            return Ok(f64::MAX);
        };
        let there = self.near(&sliding.place(direction * PREVIEW_M, 0.0)?, &sliding.q)?;
        let allowed = (0..7).map(|i| {
            let rad_per_m = (there[i] - sliding.q[i]).abs() / PREVIEW_M;
            self.bounds[i].acceleration_rad_per_s2() / rad_per_m
        });
        Ok(SLIDE_SHARE * allowed.fold(f64::INFINITY, f64::min))
    }

    /// Can the board stop before it comes where it cannot be?
    fn stops(&self, sliding: &Sliding) -> Result<(), Stop> {
        let velocity = sliding.velocity_m_per_s;
        let Some(heading) = velocity.try_normalize() else {
            return Ok(());
        };
        let able = self.able_m_per_s2(sliding, heading)?;
        let way_m = (velocity.length_squared() / (2.0 * able)).min(STOP_M);
        let end = sliding.place(heading * (way_m + PREVIEW_M), 0.0)?;
        self.near(&end, &sliding.q).map(|_| ())
    }

    /// The solution beside a configuration.
    fn near(&self, pose: &Pose, q: &JointPositions) -> Result<JointPositions, Stop> {
        let config = NearestConfig {
            policy: BranchPolicy::Keep,
            ..self.nearest
        };
        let found = self.arm.nearest_solution(pose, q, &config)?;
        if found.q.max_abs_difference(q) > DRIFT_RAD {
            return Err(Stop::Unreachable(Unreachable::OtherBranch));
        }
        Ok(found.q)
    }
}
