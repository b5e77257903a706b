//! Filter parameters that training cannot determine.

use hwall_numeric::{ArgumentError, check};

/// Filter parameters chosen on held-out demonstrations.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Tuning {
    /// Factor on the variance of the held-out noise.
    pub noise_factor: f64,
    /// Variance of the random acceleration of the phase, 1/time⁴.
    pub acceleration_variance: f64,
    /// Factor on the standard deviations of predictions, chosen so that 90 % intervals contained 90 % of the ends of held-out motions; larger if
    /// their errors are all of equal size. Used by `predict_at`, not by moments.
    pub spread: f64,
    /// Correlation time of deviations; 0: independent from sample to sample.
    pub correlation_time: f64,
    /// Factor on the standard deviation of the time to the end, chosen so that 90 % intervals contained 90 % of the ends of held-out motions. It
    /// accounts for variations of the phase velocity that are slower than the random acceleration of the filter. Absent in files of version 1.
    #[cfg_attr(feature = "serde", serde(default = "unit_spread"))]
    pub time_spread: f64,
}

#[cfg(feature = "serde")]
fn unit_spread() -> f64 {
    1.0
}

impl Tuning {
    /// Rejects numbers outside their ranges.
    pub(super) fn validate(&self) -> Result<(), ArgumentError> {
        check::positive("noise factor", self.noise_factor)?;
        check::non_negative("acceleration variance", self.acceleration_variance)?;
        check::positive("spread", self.spread)?;
        check::positive("spread of times", self.time_spread)?;
        check::non_negative("correlation time", self.correlation_time)?;
        Ok(())
    }
}
