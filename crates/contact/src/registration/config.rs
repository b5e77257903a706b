//! Settings of the estimator of a registration's error.

use crate::error::ContactError;
use glam::DVec3;
use hwall_numeric::check::{all_finite, non_negative, positive};

/// What is known of the error of a registration before any touch, and how well touches are measured.
///
/// The error is a turn about `centre_m` and an offset: what the tracker sees at `s` is at `R (s - centre) + centre + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RegistrationConfig {
    /// Standard deviation of the offset in each axis, m. Default 0.008, as [`FusedConfig::registration_sd_m`](crate::FusedConfig::registration_sd_m).
    pub offset_sd_m: f64,
    /// Standard deviation of the turn about each axis, rad. Default 0.01, over half a degree. 0 for a registration whose
    /// axes are known, as of a tracker that feels gravity and a compass that does not lie.
    pub turn_sd_rad: f64,
    /// The point that the turn is about: the middle of the points that the registration was made with, m. Default
    /// (0.6, 0, 0.6), in front of the base, where boards stand.
    pub centre_m: DVec3,
    /// Standard deviation of where the tracker has the touching point at a touch, m: noise, and a finger that yields. Default
    /// 0.004.
    pub touch_sd_m: f64,
    /// A touch counts half after so many others: trackers drift. Default 40.
    pub half_life_touches: f64,
    /// Probability that the tracker, or the arm, was moved between two touches, in (0, 1). Default 0.005.
    pub moved_probability: f64,
}

impl Default for RegistrationConfig {
    fn default() -> Self {
        Self {
            offset_sd_m: 0.008,
            turn_sd_rad: 0.01,
            centre_m: DVec3::new(0.6, 0.0, 0.6),
            touch_sd_m: 0.004,
            half_life_touches: 40.0,
            moved_probability: 0.005,
        }
    }
}

impl RegistrationConfig {
    pub(super) fn validate(&self) -> Result<(), ContactError> {
        non_negative("offset_sd_m", self.offset_sd_m)?;
        non_negative("turn_sd_rad", self.turn_sd_rad)?;
        all_finite("centre_m", &self.centre_m.to_array())?;
        positive("touch_sd_m", self.touch_sd_m)?;
        positive("half_life_touches", self.half_life_touches)?;
        let p = self.moved_probability;
        hwall_numeric::check::that(p > 0.0 && p < 1.0, "moved_probability", p, "in (0, 1)")?;
        Ok(())
    }
}
