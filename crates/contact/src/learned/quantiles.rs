//! Quantiles of weighted values, and the noise floor of errors.

use crate::matrices::isotropic;
use glam::DMat3;

/// Lowest standard deviation of a coordinate that is ever stated, m: the noise of a good tracker.
pub(in crate::learned) const SENSOR_M: f64 = 3e-4;

/// The noise of the sensor as a covariance, m².
pub(in crate::learned) fn sensor() -> DMat3 {
    isotropic(SENSOR_M)
}

/// The value below which a share of the weight lies; `values` are pairs of value and weight.
pub(in crate::learned) fn weighted_quantile(
    share: f64,
    values: impl Iterator<Item = (f64, f64)>,
) -> f64 {
    let mut values: Vec<(f64, f64)> = values.collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|v| v.1).sum();
    let mut sum = 0.0;
    let found = values.iter().find(|v| {
        sum += v.1;
        sum >= share * total
    });
    found.or(values.last()).map_or(0.0, |v| v.0)
}
