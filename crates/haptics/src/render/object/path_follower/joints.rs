//! How the joints turn for a motion of the face, and how far and fast they may.

use super::{BEFORE_LIMITS, FARTHEST, PathFollower};
use crate::render::object::face_slide::MOST_M_PER_S2;
use hwall_geometry::Twist;
use hwall_kinematics::{JointPositions, JointVelocities};
use hwall_numeric::dense::{cholesky_in_place, solve_lower, solve_lower_transposed};

/// Share of the joint speeds that following an object may use.
const SPEED_SHARE: f64 = 0.95;
/// Joints nearer than this to a limit turn less, rad; on the limit so many times less, about.
const SPARED_RAD: f64 = 0.6;
const SPARED: f64 = 40.0;
/// A joint that a slide turns no faster than this is not stopped for it, rad/s.
const IDLE_RAD_PER_S: f64 = 1e-3;
/// A slide comes no nearer than this to a joint's limit, rad: the object under it needs room, too, and an arm under torques that is
/// late must not run into its stop, which it could not tell from a hand. As wide as the margin of [`JointGuard`](crate::render::JointGuard).
const KEPT_RAD: f64 = 0.2;
/// Keeps joint rates finite near singular poses; m² rad²/s².
const DAMPING: f64 = 1e-6;
/// Rates that miss more than this share of a motion of the face do not make it.
const MISSING: f64 = 0.5;

impl PathFollower {
    /// A joint near its limit turns less than the others, as far as the arm has a choice: an object goes on opening where it
    /// would be stopped by a single joint.
    pub(super) fn spare_joints(&mut self) {
        let speeds = self.arm.max_velocity_rad_per_s();
        let limits = self.arm.limits();
        for (i, weight) in self.config.weights.iter_mut().enumerate() {
            let room = (limits[i].max_rad - self.q[i]).min(self.q[i] - limits[i].min_rad);
            let near = (1.0 - room.max(0.0) / SPARED_RAD).max(0.0);
            *weight = speeds[i].powi(-2) * (1.0 + SPARED * near * near);
        }
    }

    /// How many times too fast the joints would have to be.
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

    /// Share of the wanted slide from which every joint can still brake before its limit, while the object takes the face along its path
    /// at a rate; 0 where no joints slide it.
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
            // From this speed a joint comes to rest that brakes at a rate.
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

    /// How far the face can go in the direction of a rate before a joint meets its limit, rad or m: as if the joints went on
    /// turning as they do.
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

    /// Along the path, rad/s² or m/s².
    pub(super) fn largest_acceleration(&self, rates: &[f64; 7]) -> f64 {
        rates
            .iter()
            .zip(self.max_acceleration_rad_per_s2)
            .filter(|(rate, _)| **rate != 0.0)
            .map(|(rate, most)| most / rate.abs())
            .fold(f64::INFINITY, f64::min)
    }

    /// Change of the joint angles with the position, rad for each rad or m: the least that moves the face along its path, joints
    /// weighted as in [`follow`](Self::follow). `None` where the arm is singular.
    pub(in crate::render) fn joint_rates(&self) -> Option<[f64; 7]> {
        let at_m = self.face_at(self.reached).position_m();
        self.rates_for(&self.path.velocity_at(at_m, 1.0))
    }

    /// Rates of the joints for a motion of the face; `None` where none make it, or it is not finite.
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
        // The damping leaves out what no joints can do.
        let made = jacobian.twist(&JointVelocities(rates)).to_array();
        let size = |v: &[f64; 6]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let missing: [f64; 6] = std::array::from_fn(|k| wanted[k] - made[k]);
        (size(&missing) <= MISSING * size(&wanted)).then_some(rates)
    }
}
