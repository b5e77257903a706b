//! Limits of joint commands, checked in the same way on both sides.

use crate::client::CommandedMotion;
use hwall_kinematics::{ArmKinematics, JointLimit};

/// A commanded angle may be this far outside its limit because of rounding, rad.
const LIMIT_SLACK_RAD: f64 = 1e-9;
/// Share by which a step may exceed the largest speed: clock differences and rounding.
const SPEED_SLACK: f64 = 0.05;
/// A step of this angle is always allowed, rad: the noise of a mirrored measurement.
const STEP_SLACK_RAD: f64 = 1e-5;

/// Servo error under load, rad: first positions may be this far from the interpolator, and a joint may overshoot a commanded angle by this much.
pub(crate) const SERVO_ERROR_RAD: f64 = 0.05;

/// Which limit a command violates.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LimitViolation {
    /// A commanded angle outside the joint's range.
    #[error("joint {joint}: {value_rad} rad outside [{min_rad}, {max_rad}]")]
    Position {
        /// Joint, from 0.
        joint: usize,
        /// Angle commanded, rad.
        value_rad: f64,
        /// Lower limit, rad.
        min_rad: f64,
        /// Upper limit, rad.
        max_rad: f64,
    },
    /// A commanded angle too far from the previous one.
    #[error("joint {joint}: {speed_rad_per_s} rad/s commanded, {max_rad_per_s} are allowed")]
    Speed {
        /// Joint, from 0.
        joint: usize,
        /// Speed implied by the step, rad/s.
        speed_rad_per_s: f64,
        /// Largest speed, rad/s.
        max_rad_per_s: f64,
    },
    /// A speed change that the joint cannot make: it would far overshoot the commanded angle.
    #[error(
        "joint {joint}: the speed changes by {change_rad_per_s} rad/s at once, which takes it {swing_rad} rad past its way"
    )]
    Change {
        /// Joint, from 0.
        joint: usize,
        /// Change of its speed in one cycle, rad/s.
        change_rad_per_s: f64,
        /// Overshoot beyond the commanded angle, rad.
        swing_rad: f64,
    },
    /// A commanded torque too large.
    #[error("joint {joint}: {value_n_m} N m commanded, {max_n_m} are allowed")]
    Torque {
        /// Joint, from 0.
        joint: usize,
        /// Torque commanded, N m.
        value_n_m: f64,
        /// Largest torque, N m.
        max_n_m: f64,
    },
}

/// Ranges and speeds (positive) of the joints, and the largest overlay torques.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CommandLimits {
    range: [JointLimit; 7],
    speed_rad_per_s: [f64; 7],
    torque_n_m: [f64; 7],
}

impl CommandLimits {
    pub(crate) fn new(arm: &dyn ArmKinematics, torque_n_m: [f64; 7]) -> Self {
        Self {
            range: *arm.limits(),
            speed_rad_per_s: *arm.max_velocity_rad_per_s(),
            torque_n_m,
        }
    }

    /// Are finite angles within their ranges, and no further from the last ones than `dt_s` allows?
    pub(crate) fn check_step(
        &self,
        last_rad: &[f64; 7],
        q_rad: &[f64; 7],
        dt_s: f64,
    ) -> Result<(), LimitViolation> {
        for (joint, limit) in self.range.iter().enumerate() {
            let value_rad = q_rad[joint];
            if limit.distance_rad(value_rad) < -LIMIT_SLACK_RAD {
                return Err(LimitViolation::Position {
                    joint,
                    value_rad,
                    min_rad: limit.min_rad,
                    max_rad: limit.max_rad,
                });
            }
            let step_rad = (value_rad - last_rad[joint]).abs();
            let max_rad_per_s = self.speed_rad_per_s[joint];
            if step_rad > most_step_rad(max_rad_per_s, dt_s) {
                return Err(LimitViolation::Speed {
                    joint,
                    speed_rad_per_s: step_rad / dt_s,
                    max_rad_per_s,
                });
            }
        }
        Ok(())
    }

    /// Does the change between two motions respect the joint speeds and these accelerations?
    pub(crate) fn bears(
        &self,
        last: &CommandedMotion,
        next: &CommandedMotion,
        most_rad_per_s2: &[f64; 7],
        dt_s: f64,
    ) -> bool {
        (0..7).all(|i| {
            let change = next.speed_rad_per_s[i] - last.speed_rad_per_s[i];
            next.speed_rad_per_s[i].abs() <= self.speed_rad_per_s[i]
                && change.abs() <= most_rad_per_s2[i] * dt_s
        })
    }

    /// Can the joints make this speed change with these accelerations? An excess Δv over a cycle's acceleration makes a joint overshoot by Δv²/2a.
    pub(crate) fn check_change(
        &self,
        last: &CommandedMotion,
        next: &CommandedMotion,
        most_rad_per_s2: &[f64; 7],
        dt_s: f64,
    ) -> Result<(), LimitViolation> {
        for (joint, most) in most_rad_per_s2.iter().enumerate() {
            let change_rad_per_s = next.speed_rad_per_s[joint] - last.speed_rad_per_s[joint];
            let beyond = (change_rad_per_s.abs() - most * dt_s).max(0.0);
            let swing_rad = beyond * beyond / (2.0 * most);
            if swing_rad > SERVO_ERROR_RAD {
                return Err(LimitViolation::Change {
                    joint,
                    change_rad_per_s,
                    swing_rad,
                });
            }
        }
        Ok(())
    }

    /// Moves from the last angles towards finite ones, no further than the joints can move in `dt_s`.
    pub(crate) fn led(&self, last_rad: &[f64; 7], to_rad: &[f64; 7], dt_s: f64) -> [f64; 7] {
        self.towards(last_rad, to_rad, |speed_rad_per_s| speed_rad_per_s * dt_s)
    }

    /// The same, as far as [`check_step`](Self::check_step) allows.
    pub(crate) fn followed(&self, last_rad: &[f64; 7], to_rad: &[f64; 7], dt_s: f64) -> [f64; 7] {
        self.towards(last_rad, to_rad, |speed_rad_per_s| {
            most_step_rad(speed_rad_per_s, dt_s)
        })
    }

    fn towards(
        &self,
        last_rad: &[f64; 7],
        to_rad: &[f64; 7],
        most_rad: impl Fn(f64) -> f64,
    ) -> [f64; 7] {
        let to_rad = self.clamped(to_rad);
        std::array::from_fn(|i| {
            let most_rad = most_rad(self.speed_rad_per_s[i]);
            last_rad[i] + (to_rad[i] - last_rad[i]).clamp(-most_rad, most_rad)
        })
    }

    /// Are the torques within their limits? NaN, as from a sum of two infinities, is not.
    pub(crate) fn check_torque(&self, torque_n_m: &[f64; 7]) -> Result<(), LimitViolation> {
        for (joint, (&value_n_m, &max_n_m)) in torque_n_m.iter().zip(&self.torque_n_m).enumerate() {
            if value_n_m.is_nan() || value_n_m.abs() > max_n_m {
                return Err(LimitViolation::Torque {
                    joint,
                    value_n_m,
                    max_n_m,
                });
            }
        }
        Ok(())
    }

    /// The angles, clamped to their ranges.
    pub(crate) fn clamped(&self, q_rad: &[f64; 7]) -> [f64; 7] {
        std::array::from_fn(|i| q_rad[i].clamp(self.range[i].min_rad, self.range[i].max_rad))
    }
}

/// Largest step that counts as within the speed limit, rad.
fn most_step_rad(max_rad_per_s: f64, dt_s: f64) -> f64 {
    STEP_SLACK_RAD + (1.0 + SPEED_SLACK) * max_rad_per_s * dt_s
}

#[cfg(test)]
mod tests {
    use super::CommandLimits;
    use hwall_kinematics::SrsArm;

    #[test]
    fn torques_that_are_no_numbers_are_too_large() {
        let limits = CommandLimits::new(&SrsArm::iiwa7(), [10.0; 7]);
        let mut torque_n_m = [-10.0; 7];
        assert!(limits.check_torque(&torque_n_m).is_ok());
        for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 10.000_001] {
            torque_n_m[5] = wrong;
            assert!(limits.check_torque(&torque_n_m).is_err(), "{wrong}");
        }
    }
}
