//! Settings of the follower.

use super::approach_config::ApproachConfig;
use crate::board::QUARTER_TURNS_RAD;
use crate::error::HapticsError;
use hwall_motion::MotionConfig;
use hwall_numeric::check::{all_finite, non_negative, that};

/// Settings of [`Follower`](super::Follower).
#[derive(Debug, Clone, PartialEq)]
pub struct FollowerConfig {
    /// Limits of speed, acceleration and jerk; default those of the iiwa 7 with 0.999 of its speeds, so that rounding does not exceed them.
    pub motion: MotionConfig,
    /// How the board stays behind the surfaces on its path.
    pub approach: ApproachConfig,
    /// Rolls of the board about the normal that may be used, rad, see [`board_pose`](crate::board_pose); default the quarter turns of a square board.
    pub rolls_rad: Vec<f64>,
    /// A target that moved further than this counts as new, m; default 0.05.
    pub far_m: f64,
    /// A target that turned further than this counts as new, rad; default 0.2.
    pub far_rad: f64,
}

impl Default for FollowerConfig {
    fn default() -> Self {
        Self {
            motion: MotionConfig {
                speed_share: 0.999,
                ..MotionConfig::default()
            },
            approach: ApproachConfig::default(),
            rolls_rad: QUARTER_TURNS_RAD.to_vec(),
            far_m: 0.05,
            far_rad: 0.2,
        }
    }
}

impl FollowerConfig {
    /// Rejects settings outside their ranges and an empty list of rolls. The motion settings are checked together with the arm.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        self.approach.validate()?;
        let valid = !self.rolls_rad.is_empty();
        that(valid, "number of rolls", 0.0, "at least 1")?;
        all_finite("rolls_rad", &self.rolls_rad)?;
        non_negative("far_m", self.far_m)?;
        non_negative("far_rad", self.far_rad)?;
        Ok(())
    }
}
