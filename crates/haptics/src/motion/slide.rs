//! Motion of a touched board within its own plane.

use super::profile::JointBounds;
use super::solver::{Solver, Stop};
use crate::error::HapticsError;
use glam::{DMat3, DVec3};
use hwall_geometry::Pose;
use hwall_kinematics::{JointPositions, Unreachable};
use hwall_numeric::check::{all_finite, finite};

/// Path length over which a slide differentiates the joint angles, m; a turn counts as the path of a point this far from the centre, m.
const PREVIEW_M: f64 = 1e-4;
const EDGE_M: f64 = 0.1;

/// Greatest distance ahead at which a slide checks for a place to stop, m: 0.1 m/s at 0.5 m/s².
const STOP_M: f64 = 0.01;

/// Share of the joint accelerations that a slide plans with. The rest keeps the joints on the path, whose curvature also needs acceleration.
const SLIDE_SHARE: f64 = 0.9;

/// Time constant of the two low-pass filters on the commanded velocity, s: an arm cannot follow a step of the acceleration and would overshoot.
/// Within 5 % after 29 ms.
const SMOOTH_S: f64 = 0.006;
/// Time constant of the end of a slide whose joints could stop at once, s: about as smooth as the beginning.
pub(super) const ENDS_S: f64 = 2.0 * SMOOTH_S;

/// Commanded motion of a touched board within its plane, in the robot base frame.
///
/// The board reaches the velocities as fast as its joints allow and then keeps them. It does not make up for the distance lost meanwhile, because
/// that would exceed the requested speed. The component along the board's normal is ignored: a slide never pushes.
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
        all_finite("velocity_m_per_s", &self.velocity_m_per_s.to_array())?;
        finite("turn_rad_per_s", self.turn_rad_per_s)?;
        Ok(())
    }

    /// Does it continue in the direction of another slide?
    pub(super) fn goes_on(&self, other: &Self) -> bool {
        let turns = EDGE_M * EDGE_M * self.turn_rad_per_s * other.turn_rad_per_s;
        self.velocity_m_per_s.dot(other.velocity_m_per_s) + turns > 0.0
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

    fn plus(self, other: Self) -> Self {
        Self {
            linear: self.linear + other.linear,
            angular: self.angular + other.angular,
        }
    }

    fn minus(self, other: Self) -> Self {
        self.plus(other.times(-1.0))
    }

    /// Greatest motion of a point [`EDGE_M`] from the centre, m or m/s.
    fn size(self) -> f64 {
        self.linear.length() + EDGE_M * self.angular.abs()
    }
}

/// A slide under way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sliding {
    /// The board's pose where the slide began.
    pose: Pose,
    /// The displacement since then, and the velocity.
    moved: Planar,
    velocity: Planar,
    /// The commanded velocity after the first low-pass.
    aim: Planar,
    /// The configuration commanded last.
    q: JointPositions,
}

impl Sliding {
    /// At rest in a configuration that holds the board at a pose.
    pub(super) fn new(pose: Pose, q: JointPositions) -> Self {
        Self {
            pose,
            moved: Planar::default(),
            velocity: Planar::default(),
            aim: Planar::default(),
            q,
        }
    }

    /// The configuration commanded last.
    pub(super) const fn q(&self) -> JointPositions {
        self.q
    }

    /// Advances by one step. Solves four configurations.
    ///
    /// # Errors
    /// The arm cannot hold the board there, or could no longer stop it before such a place.
    pub(super) fn next(
        &self,
        dt_s: f64,
        slide: &Slide,
        bounds: &[JointBounds; 7],
        solver: &mut Solver,
    ) -> Result<Next, Stop> {
        let smooth = -(-dt_s / SMOOTH_S).exp_m1();
        let mut began = *self;
        began.aim = self
            .aim
            .plus(self.wanted(slide).minus(self.aim).times(smooth));
        let change = began.aim.minus(self.velocity).times(smooth);
        let share = (self.most_per_s(change, bounds, solver)? * dt_s).min(1.0);
        let mut sliding = began.advanced(change.times(share), dt_s);
        sliding.q = solver.beside(&sliding.place(Planar::default())?, &self.q)?;
        let rate_rad_per_s = sliding.rates(sliding.velocity, solver)?;
        sliding.can_stop(&rate_rad_per_s, bounds, solver)?;
        Ok(Next {
            sliding,
            rate_rad_per_s,
        })
    }

    /// The acceleration along a direction that all joints allow, m/s².
    pub(super) fn acceleration_along_m_per_s2(
        &self,
        direction: DVec3,
        bounds: &[JointBounds; 7],
        solver: &mut Solver,
    ) -> Option<f64> {
        let unit = Planar {
            linear: direction.try_normalize()?,
            angular: 0.0,
        };
        Some(self.most_per_s(unit, bounds, solver).ok()? / SLIDE_SHARE)
    }

    /// Joint velocities for a velocity of the board, rad/s.
    fn rates(&self, velocity: Planar, solver: &mut Solver) -> Result<[f64; 7], Stop> {
        let size = velocity.size();
        if size == 0.0 {
            return Ok([0.0; 7]);
        }
        let preview_s = PREVIEW_M / size;
        let there = self.place(velocity.times(preview_s))?;
        let there = solver.beside(&there, &self.q)?;
        Ok(std::array::from_fn(|i| (there[i] - self.q[i]) / preview_s))
    }

    /// Inverse of the time in which the joints can reach a velocity of the board, 1/s.
    fn most_per_s(
        &self,
        velocity: Planar,
        bounds: &[JointBounds; 7],
        solver: &mut Solver,
    ) -> Result<f64, Stop> {
        Ok(most_per_s(&self.rates(velocity, solver)?, bounds))
    }

    /// Can the board stop before it reaches a place where the arm cannot hold it?
    fn can_stop(
        &self,
        rates: &[f64; 7],
        bounds: &[JointBounds; 7],
        solver: &mut Solver,
    ) -> Result<(), Stop> {
        let size = self.velocity.size();
        if size == 0.0 {
            return Ok(());
        }
        let stop_s = 1.0 / most_per_s(rates, bounds);
        let ahead_s = 0.5 * stop_s + ENDS_S;
        // A joint that reaches its limit would have to stop at once while others take over.
        if solver.meets_limit(&self.q, rates, ahead_s) {
            return Err(Stop::Unreachable(Unreachable::OtherBranch));
        }
        let ahead_s = ahead_s.min(STOP_M / size) + PREVIEW_M / size;
        let end = self.place(self.velocity.times(ahead_s))?;
        solver.beside(&end, &self.q).map(|_| ())
    }

    /// The velocity of a slide within the plane.
    fn wanted(&self, slide: &Slide) -> Planar {
        Planar {
            linear: slide
                .velocity_m_per_s
                .reject_from_normalized(self.pose.rotation().z_axis),
            angular: slide.turn_rad_per_s,
        }
    }

    /// The slide after one step, with a change of its velocity.
    fn advanced(mut self, change: Planar, dt_s: f64) -> Self {
        let before = self.velocity;
        self.velocity.linear += change.linear;
        self.velocity.angular += change.angular;
        self.moved.linear += 0.5 * dt_s * (before.linear + self.velocity.linear);
        self.moved.angular += 0.5 * dt_s * (before.angular + self.velocity.angular);
        self
    }

    /// The pose of the board further ahead.
    fn place(&self, ahead: Planar) -> Result<Pose, Stop> {
        let turned = self.moved.angular + ahead.angular;
        let rotation = self.pose.rotation() * DMat3::from_rotation_z(turned);
        let position_m = self.pose.position_m() + self.moved.linear + ahead.linear;
        Ok(Pose::new(rotation, position_m).map_err(HapticsError::from)?)
    }
}

/// Inverse of the time in which the joints can reach their velocities, 1/s.
fn most_per_s(rates: &[f64; 7], bounds: &[JointBounds; 7]) -> f64 {
    let most = (0..7).map(|i| bounds[i].acceleration_rad_per_s2 / rates[i].abs());
    // Finite also where nothing moves: the share is then capped at 1.
    SLIDE_SHARE * most.fold(f64::MAX, f64::min)
}

/// A slide after one step.
pub(super) struct Next {
    pub(super) sliding: Sliding,
    pub(super) rate_rad_per_s: [f64; 7],
}
