//! Joint motion for a motion of the face, and its limits.

use super::{BEFORE_LIMITS, FARTHEST, PathFollower};
use crate::render::object::face_slide::MOST_M_PER_S2;
use hwall_geometry::Twist;
use hwall_kinematics::{JointPositions, JointVelocities};
use hwall_numeric::dense::{cholesky_in_place, solve_lower, solve_lower_transposed};

/// Share of the joint speeds for following an object.
const SPEED_SHARE: f64 = 0.95;
/// Joints closer than this to a limit turn less, rad; at the limit by about this factor.
const SPARED_RAD: f64 = 0.6;
const SPARED: f64 = 40.0;
/// A joint that a slide turns no faster than this does not limit the slide, rad/s.
const IDLE_RAD_PER_S: f64 = 1e-3;
/// Distance that a slide keeps from a joint's limit, rad: the object under it needs range as well, and a lagging torque-controlled arm must not hit
/// its stop, which it could not tell from a hand. As wide as the margin of [`JointGuard`](crate::render::JointGuard).
const KEPT_RAD: f64 = 0.2;
/// Damping that keeps joint rates finite near singular poses; m² rad²/s².
const DAMPING: f64 = 1e-6;
/// Joint rates that miss more than this share of the face's motion do not count as a solution.
const MISSING: f64 = 0.5;

impl PathFollower {
    /// Makes a joint near its limit turn less than the others, as far as the arm is redundant: an object keeps opening where a single joint would
    /// stop it.
    pub(super) fn spare_joints(&mut self) {
        let speeds = self.arm.max_velocity_rad_per_s();
        let limits = self.arm.limits();
        for (i, weight) in self.config.weights.iter_mut().enumerate() {
            let room = (limits[i].max_rad - self.q[i]).min(self.q[i] - limits[i].min_rad);
            let near = (1.0 - room.max(0.0) / SPARED_RAD).max(0.0);
            *weight = speeds[i].powi(-2) * (1.0 + SPARED * near * near);
        }
    }

    /// By which factor the joints would be too fast, at least 1.
    pub(super) fn excess(&self, q: &JointPositions, dt_s: f64) -> f64 {
        let speeds = self.arm.max_velocity_rad_per_s();
        (0..self.arm.joint_count())
            .map(|i| (q[i] - self.q[i]).abs() / (SPEED_SHARE * speeds[i] * dt_s))
            .fold(1.0, f64::max)
    }

    /// How far a joint is from its limit in the direction of a rate, rad.
    fn room_rad(&self, joint: usize, rate: f64) -> f64 {
        let limit = &self.arm.limits()[joint];
        match rate > 0.0 {
            true => limit.max_rad - self.q[joint],
            false => self.q[joint] - limit.min_rad,
        }
    }

    /// Share of the wanted slide at which every joint can still brake before its limit, while the object moves the face along its path at a rate; 0
    /// if no joints can slide it.
    pub(super) fn slide_share(&self, rates: &[f64; 7], rate: f64) -> f64 {
        let size = self.wanted_slide.size();
        if size == 0.0 {
            return 1.0;
        }
        let place = self.place();
        let Some(wanted) = self.rates_for(&self.wanted_slide.twist(&self.slide.on(&place))) else {
            return 0.0;
        };
        let share = |i: usize| {
            let towards = wanted[i].signum();
            let room = self.room_rad(i, towards);
            // From this speed, a joint that brakes at a rate comes to rest.
            let room = (room - KEPT_RAD).max(0.0);
            let most = |braking: f64| (2.0 * BEFORE_LIMITS * braking * room).sqrt();
            let alone = most(wanted[i].abs() / size * MOST_M_PER_S2);
            let taken = (rates[i] * rate * towards).max(0.0);
            let left = (most(self.max_acceleration_rad_per_s2[i]) - taken).max(0.0);
            alone.min(left) / wanted[i].abs()
        };
        (0..self.arm.joint_count())
            .filter(|i| wanted[*i].abs() > IDLE_RAD_PER_S)
            .map(share)
            .fold(1.0, f64::min)
    }

    /// How far the face can move in the direction of a rate before a joint meets its limit, rad or m, assuming constant joint rates.
    pub(super) fn left(&self, rates: &[f64; 7], rate: f64) -> f64 {
        let left = |i: usize| {
            let towards = rates[i] * rate.signum();
            self.room_rad(i, towards).max(0.0) / towards.abs()
        };
        (0..self.arm.joint_count())
            .filter(|i| rates[*i] != 0.0)
            .map(left)
            .fold(FARTHEST, f64::min)
    }

    /// Largest acceleration along the path, rad/s² or m/s².
    pub(super) fn largest_acceleration(&self, rates: &[f64; 7]) -> f64 {
        rates
            .iter()
            .zip(self.max_acceleration_rad_per_s2)
            .filter(|(rate, _)| **rate != 0.0)
            .map(|(rate, most)| most / rate.abs())
            .fold(f64::INFINITY, f64::min)
    }

    /// Change of the joint angles with the position, rad for each rad or m: the smallest that moves the face along its path, with joints weighted as
    /// in [`follow`](Self::follow). `None` where the arm is singular.
    pub(in crate::render) fn joint_rates(&self) -> Option<[f64; 7]> {
        let at_m = self.face_at(self.reached).position_m();
        self.rates_for(&self.path.velocity_at(at_m, 1.0))
    }

    /// Joint rates for a motion of the face; `None` if there are none, or the motion is not finite.
    pub(super) fn rates_for(&self, twist: &Twist) -> Option<[f64; 7]> {
        let joints = self.arm.joint_count();
        let jacobian = self.arm.jacobian(&self.q);
        let wanted = twist.to_array();
        let row = |k: usize, i: usize| {
            if k < 3 {
                jacobian.linear[i][k]
            } else {
                jacobian.angular[i][k - 3]
            }
        };
        let weights = &self.config.weights;
        let mut square = [0.0; 36];
        for a in 0..6 {
            for b in 0..=a {
                square[6 * a + b] = (0..joints)
                    .map(|i| row(a, i) * row(b, i) / weights[i])
                    .sum();
            }
            square[7 * a] += DAMPING;
        }
        cholesky_in_place(6, &mut square).ok()?;
        let mut forces = wanted;
        solve_lower(&square, &mut forces);
        solve_lower_transposed(&square, &mut forces);
        let rates: [f64; 7] = std::array::from_fn(|i| {
            if i >= joints {
                return 0.0;
            }
            let pull: f64 = (0..6).map(|k| row(k, i) * forces[k]).sum();
            pull / weights[i]
        });
        // The damping drops what no joints can do.
        let made = jacobian.twist(&JointVelocities(rates)).to_array();
        let size = |v: &[f64; 6]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let missing: [f64; 6] = std::array::from_fn(|k| wanted[k] - made[k]);
        (size(&missing) <= MISSING * size(&wanted)).then_some(rates)
    }
}
