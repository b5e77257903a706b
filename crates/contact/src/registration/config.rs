//! Settings of the estimator of a registration's error.

use crate::error::ContactError;
use glam::DVec3;
use hwall_numeric::check::{all_finite, non_negative, positive};

/// Prior of the registration error, and the measurement error of touches.
///
/// The error is a rotation about `centre_m` and an offset: a point tracked at `s` is at `R (s - centre) + centre + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RegistrationConfig {
    /// Standard deviation of the offset in each axis, m. Default 0.008, as [`FusedConfig::registration_sd_m`](crate::FusedConfig::registration_sd_m).
    pub offset_sd_m: f64,
    /// Standard deviation of the rotation about each axis, rad. Default 0.01, over half a degree. 0 for a registration with known axes, e.g. a
    /// tracker with gravity and a reliable compass.
    pub turn_sd_rad: f64,
    /// Centre of the rotation: the middle of the points used for the registration, m. Default (0.6, 0, 0.6), in front of the base, where boards
    /// stand.
    pub centre_m: DVec3,
    /// Standard deviation of the tracked touching point at a touch, m: noise, and a finger that yields. Default 0.004.
    pub touch_sd_m: f64,
    /// Number of further touches after which a touch counts half: trackers drift. Default 40.
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
