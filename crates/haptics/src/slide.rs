//! Motion of a touched board within its own plane.

use crate::error::{finite, non_negative};
use crate::follower::DRIFT_RAD;
use crate::{Follower, HapticsError};
use glam::{DMat3, DVec3};
use hwall_kinematics::{
    BranchPolicy, JointPositions, KinematicsError, NearestConfig, Pose, Unreachable,
};

/// How far a slide is looked ahead for the velocities of the joints, m; a turn counts by the way of a
/// place this far off the middle, m.
const PREVIEW_M: f64 = 1e-4;
const EDGE_M: f64 = 0.1;

/// A slide looks no further ahead for where it could stop, m: 0.1 m/s at 0.5 m/s².
const STOP_M: f64 = 0.01;

/// Share of the joints' accelerations that a slide plans with; the rest holds them on the path, whose
/// curvature in the joints costs some too.
const SLIDE_SHARE: f64 = 0.9;

/// How a touched board shall move within its plane, in the robot base frame.
///
/// The board takes up the velocities as fast as its joints allow and then keeps them; way that it lost
/// meanwhile it does not catch up, because that would need more speed than was asked for. A part along the
/// board's normal is left out: a slide never pushes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Slide {
    /// Velocity, m/s.
    pub velocity_m_per_s: DVec3,
    /// Turn about the outward normal, rad/s.
    pub turn_rad_per_s: f64,
}

impl Slide {
    /// Rejects NaN and infinities.
    ///
    /// # Errors
    /// The first value that is not finite.
    pub fn validate(&self) -> Result<(), HapticsError> {
        finite("velocity_m_per_s", &self.velocity_m_per_s.to_array())?;
        finite("turn_rad_per_s", &[self.turn_rad_per_s])
    }
}

/// A velocity and a turn within a plane.
#[derive(Debug, Clone, Copy, Default)]
struct Planar {
    linear: DVec3,
    angular: f64,
}

impl Planar {
    fn times(self, factor: f64) -> Self {
        Self {
            linear: self.linear * factor,
            angular: self.angular * factor,
        }
    }

    /// Metres, or metres a second, that a place [`EDGE_M`] off the middle moves by at most.
    fn size(self) -> f64 {
        self.linear.length() + EDGE_M * self.angular.abs()
    }
}

/// A slide under way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sliding {
    /// The board where the slide began.
    pose: Pose,
    /// Its way since, and its velocity.
    moved: Planar,
    velocity: Planar,
    /// The configuration that it asked for last.
    q: JointPositions,
}

impl Sliding {
    fn new(pose: Pose, q: JointPositions) -> Self {
        Self {
            pose,
            moved: Planar::default(),
            velocity: Planar::default(),
            q,
        }
    }

    /// From the present velocity to that of a slide.
    fn change_to(&self, slide: &Slide) -> Planar {
        let along = slide
            .velocity_m_per_s
            .reject_from_normalized(self.pose.rotation().z_axis);
        Planar {
            linear: along - self.velocity.linear,
            angular: slide.turn_rad_per_s - self.velocity.angular,
        }
    }

    /// The slide one step on, with a change of its velocity.
    fn advanced(mut self, change: Planar, dt_s: f64) -> Self {
        let before = self.velocity;
        self.velocity.linear += change.linear;
        self.velocity.angular += change.angular;
        self.moved.linear += 0.5 * dt_s * (before.linear + self.velocity.linear);
        self.moved.angular += 0.5 * dt_s * (before.angular + self.velocity.angular);
        self
    }

    /// The board, further on.
    fn place(&self, ahead: Planar) -> Result<Pose, Stop> {
        let turned = self.moved.angular + ahead.angular;
        let rotation = self.pose.rotation() * DMat3::from_rotation_z(turned);
        let position_m = self.pose.position_m() + self.moved.linear + ahead.linear;
        Ok(Pose::new(rotation, position_m).map_err(HapticsError::from)?)
    }
}

/// Why a slide cannot go on.
enum Stop {
    Unreachable(Unreachable),
    Error(HapticsError),
}

impl From<HapticsError> for Stop {
    fn from(error: HapticsError) -> Self {
        Self::Error(error)
    }
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
        let at = Sliding::new(self.arm.forward(&q), q);
        let unit = Planar {
            linear: direction.try_normalize()?,
            angular: 0.0,
        };
        Some(self.most_per_s(&at, unit).ok()? / SLIDE_SHARE)
    }

    fn slid(&self, dt_s: f64, slide: &Slide) -> Result<Next, Stop> {
        let sliding = self.sliding.unwrap_or_else(|| self.at_rest());
        let (mut next, mut unreachable) = (sliding, None);
        for wanted in [*slide, Slide::default()] {
            let change = sliding.change_to(&wanted);
            let share = (self.most_per_s(&sliding, change)? * dt_s).min(1.0);
            next = sliding.advanced(change.times(share), dt_s);
            match self.stops(&next) {
                Ok(()) => break,
                Err(Stop::Unreachable(reason)) if unreachable.is_none() => {
                    unreachable = Some(reason);
                }
                Err(stop) => return Err(stop),
            }
        }
        next.q = self.near(&next.place(Planar::default())?, &sliding.q)?;
        Ok(Next {
            rate_rad_per_s: self.rates(&next, next.velocity)?,
            sliding: next,
            unreachable,
        })
    }

    /// A slide that begins where braking ends.
    fn at_rest(&self) -> Sliding {
        let q = JointPositions(std::array::from_fn(|i| {
            let limit = self.arm.limits()[i];
            let stop = self.motion[i].stopping_point_rad(&self.bounds[i]);
            stop.clamp(limit.min_rad, limit.max_rad)
        }));
        Sliding::new(self.arm.forward(&q), q)
    }

    /// The joints' rates for a velocity of the board, rad/s.
    fn rates(&self, sliding: &Sliding, velocity: Planar) -> Result<[f64; 7], Stop> {
        let size = velocity.size();
        if size == 0.0 {
            return Ok([0.0; 7]);
        }
        let preview_s = PREVIEW_M / size;
        let there = sliding.place(velocity.times(preview_s))?;
        let there = self.near(&there, &sliding.q)?;
        Ok(std::array::from_fn(|i| {
            (there[i] - sliding.q[i]) / preview_s
        }))
    }

    /// How often a second the joints could take up a velocity.
    fn most_per_s(&self, sliding: &Sliding, velocity: Planar) -> Result<f64, Stop> {
        let rates = self.rates(sliding, velocity)?;
        let most = (0..7).map(|i| self.bounds[i].acceleration_rad_per_s2() / rates[i].abs());
        // Finite also where nothing moves: its share is then capped at 1.
        Ok(SLIDE_SHARE * most.fold(f64::MAX, f64::min))
    }

    /// Can the board stop before it comes where it cannot be?
    fn stops(&self, sliding: &Sliding) -> Result<(), Stop> {
        let velocity = sliding.velocity;
        let size = velocity.size();
        if size == 0.0 {
            return Ok(());
        }
        let stop_s = 1.0 / self.most_per_s(sliding, velocity)?;
        let ahead_s = (0.5 * stop_s).min(STOP_M / size) + PREVIEW_M / size;
        let end = sliding.place(velocity.times(ahead_s))?;
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
