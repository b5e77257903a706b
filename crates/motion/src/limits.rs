//! Motion limits of an arm's joints.

use crate::error::MotionError;
use crate::joint::JointBounds;
use crate::travel_time::{farthest_rad, travel_time_s};
use hwall_kinematics::{ArmKinematics, JointPositions, JointVelocities, MOST_JOINTS};
use hwall_numeric::check::{positive, within};

/// Largest joint accelerations of the iiwa 7, rad/s². Source: the acceleration limits of the arm description in Drake ([Drake models]); the
/// manufacturer publishes none.
pub const IIWA7_ACCELERATION_RAD_PER_S2: [f64; MOST_JOINTS] =
    [8.65, 5.44, 5.69, 11.01, 11.78, 13.76, 13.17];

/// Settings that determine [`MotionLimits`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionConfig {
    /// Share of the arm's joint speeds that is used, in (0, 1]; default 1.
    pub speed_share: f64,
    /// Largest joint accelerations for an arm that states none, rad/s²; default those of the iiwa 7, [`IIWA7_ACCELERATION_RAD_PER_S2`].
    pub acceleration_rad_per_s2: [f64; MOST_JOINTS],
    /// Time in which a joint at rest reaches its full acceleration, s: jerk is acceleration divided by it. Default 0.02, an assumption; no jerk limit
    /// of the iiwa is published.
    pub jerk_time_s: f64,
}

impl Default for MotionConfig {
    fn default() -> Self {
        Self {
            speed_share: 1.0,
            acceleration_rad_per_s2: IIWA7_ACCELERATION_RAD_PER_S2,
            jerk_time_s: 0.02,
        }
    }
}

/// Largest speed, acceleration and jerk of every joint, the same in both directions. Entries beyond the arm's last joint
/// are 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// Largest speeds, rad/s.
    pub velocity_rad_per_s: [f64; MOST_JOINTS],
    /// Largest accelerations, rad/s².
    pub acceleration_rad_per_s2: [f64; MOST_JOINTS],
    /// Largest jerks, rad/s³.
    pub jerk_rad_per_s3: [f64; MOST_JOINTS],
}

impl MotionLimits {
    /// The limits of an arm.
    ///
    /// # Errors
    /// A setting outside its range, or an arm with a joint speed that is not positive.
    pub fn of_arm(arm: &dyn ArmKinematics, config: &MotionConfig) -> Result<Self, MotionError> {
        positive("speed_share", config.speed_share)?;
        let share = config.speed_share;
        within("speed_share", share, ..=1.0, "at most 1")?;
        positive("jerk_time_s", config.jerk_time_s)?;
        let mut limits = Self {
            velocity_rad_per_s: [1.0; MOST_JOINTS],
            acceleration_rad_per_s2: [1.0; MOST_JOINTS],
            jerk_rad_per_s3: [1.0; MOST_JOINTS],
        };
        let most = arm.accelerations_or(config.acceleration_rad_per_s2);
        for (joint, most) in most.into_iter().enumerate().take(arm.joint_count()) {
            limits.velocity_rad_per_s[joint] = share * arm.max_velocity_rad_per_s()[joint];
            limits.acceleration_rad_per_s2[joint] = most;
            limits.jerk_rad_per_s3[joint] = most / config.jerk_time_s;
        }
        limits.validate()?;
        Ok(limits)
    }

    /// The least time in which all joints come to rest without a jerk limit, s.
    #[must_use]
    pub fn stop_s(&self, qd: &JointVelocities) -> f64 {
        let each = qd.0.iter().zip(&self.acceleration_rad_per_s2);
        each.map(|(qd, most)| qd.abs() / most).fold(0.0, f64::max)
    }

    /// Rejects limits outside 1e-6 to 1e9.
    ///
    /// # Errors
    /// The first limit outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), MotionError> {
        for (what, values) in [
            ("velocity_rad_per_s", &self.velocity_rad_per_s),
            ("acceleration_rad_per_s2", &self.acceleration_rad_per_s2),
            ("jerk_rad_per_s3", &self.jerk_rad_per_s3),
        ] {
            for &value in values {
                within(what, value, 1e-6..=1e9, "between 1e-6 and 1e9")?;
            }
        }
        Ok(())
    }

    /// The bounds of each joint.
    ///
    /// # Errors
    /// As [`validate`](Self::validate).
    pub fn bounds(&self) -> Result<[JointBounds; MOST_JOINTS], MotionError> {
        self.validate()?;
        let mut bounds = [JointBounds::new(1.0, 1.0, 1.0)?; MOST_JOINTS];
        for (i, bounds) in bounds.iter_mut().enumerate() {
            *bounds = JointBounds::new(
                self.velocity_rad_per_s[i],
                self.acceleration_rad_per_s2[i],
                self.jerk_rad_per_s3[i],
            )?;
        }
        Ok(bounds)
    }

    /// Least time from rest at one configuration to rest at another, s: that of the slowest joint.
    ///
    /// Closed form with a relative error of 1e-12; NaN in gives NaN.
    #[must_use]
    pub fn travel_time_s(&self, from: &JointPositions, to: &JointPositions) -> f64 {
        let of_joint = |i: usize| {
            travel_time_s(
                (to[i] - from[i]).abs(),
                self.velocity_rad_per_s[i],
                self.acceleration_rad_per_s2[i],
                self.jerk_rad_per_s3[i],
            )
        };
        // `f64::max` would drop NaN.
        (0..MOST_JOINTS).map(of_joint).fold(0.0, |most: f64, time| {
            if most.is_nan() || time <= most {
                most
            } else {
                time
            }
        })
    }

    /// The largest distance that each joint can move from rest to rest in a time, rad. A configuration is within `time_s` of another if no joint
    /// differs by more, so a search for the nearest in time needs only comparisons.
    ///
    /// The inverse of [`travel_time_s`](Self::travel_time_s) for each joint, with a relative error of 1e-9. A time of zero or less gives zeros; NaN
    /// in gives NaN.
    #[must_use]
    pub fn farthest_rad(&self, time_s: f64) -> [f64; MOST_JOINTS] {
        let time_s = if time_s < 0.0 { 0.0 } else { time_s };
        std::array::from_fn(|i| {
            farthest_rad(
                time_s,
                self.velocity_rad_per_s[i],
                self.acceleration_rad_per_s2[i],
                self.jerk_rad_per_s3[i],
            )
        })
    }
}
