//! Settings of the simulated servo.

use crate::error::SimError;
use hwall_kinematics::ArmKinematics;
use hwall_motion::{IIWA7_ACCELERATION_RAD_PER_S2, JointBounds};
use hwall_numeric::check::{non_negative, within};

/// Settings of a [`ServoArm`](crate::ServoArm). Entries beyond the arm's last joint are ignored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoConfig {
    /// Time from a command to its first effect, s, `0..=1`. Default 0.022, the figure measured
    /// on the iiwa of the reference set-up ([H-Wall]).
    pub reaction_delay_s: f64,
    /// Largest joint speeds, rad/s, `1e-3..=1e6`. `None`, the default: those of the arm, as published by the manufacturer.
    pub max_velocity_rad_per_s: Option<[f64; 7]>,
    /// Largest joint accelerations if the arm defines none, rad/s², `1e-3..=1e6`. Default
    /// [`IIWA7_ACCELERATION_RAD_PER_S2`], 5.4 to 13.8 by joint ([Drake models]); the manufacturer publishes none.
    pub max_acceleration_rad_per_s2: [f64; 7],
    /// Time to build up full acceleration, s, `1e-4..=1`: the largest jerk is the acceleration divided by it.
    /// Default 0.01, an assumption, since no jerk of the iiwa is published. It is half the value of
    /// `hwall_motion::MotionConfig`, so that the servo can catch up with a planned motion.
    pub jerk_time_s: f64,
    /// Standard deviation of the noise on every external torque, N m. Default 0.05: an
    /// assumption; 3 N on the board give some N m at the first joints.
    pub torque_noise_n_m: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for ServoConfig {
    fn default() -> Self {
        Self {
            reaction_delay_s: 0.022,
            max_velocity_rad_per_s: None,
            max_acceleration_rad_per_s2: IIWA7_ACCELERATION_RAD_PER_S2,
            jerk_time_s: 0.01,
            torque_noise_n_m: 0.05,
            seed: 0,
        }
    }
}

impl ServoConfig {
    /// The bounds of every joint. Speeds and accelerations outside `1e-3..=1e6` are rejected: below 1e-3, a joint hardly
    /// moves within hours.
    pub(super) fn bounds(&self, arm: &dyn ArmKinematics) -> Result<[JointBounds; 7], SimError> {
        let (delay_s, rise_s) = (self.reaction_delay_s, self.jerk_time_s);
        within("reaction_delay_s", delay_s, 0.0..=1.0, "between 0 and 1")?;
        within("jerk_time_s", rise_s, 1e-4..=1.0, "between 1e-4 and 1")?;
        non_negative("torque_noise_n_m", self.torque_noise_n_m)?;
        let velocity = self
            .max_velocity_rad_per_s
            .unwrap_or(*arm.max_velocity_rad_per_s());
        let most = arm.accelerations_or(self.max_acceleration_rad_per_s2);
        let mut bounds = [JointBounds::new(1.0, 1.0, 1.0)?; 7];
        for (joint, bounds) in bounds.iter_mut().enumerate().take(arm.joint_count()) {
            let (speed, acceleration) = (velocity[joint], most[joint]);
            for (what, value) in [
                ("max_velocity_rad_per_s", speed),
                ("max_acceleration_rad_per_s2", acceleration),
            ] {
                within(what, value, 1e-3..=1e6, "between 1e-3 and 1e6")?;
            }
            *bounds = JointBounds::new(speed, acceleration, acceleration / rise_s)?;
        }
        Ok(bounds)
    }
}
