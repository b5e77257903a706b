//! The velocity of noisy positions.

use glam::DVec3;

/// Slope of the straight line through positions, m, at times, s; zero for a single one.
pub(crate) fn slope(samples: impl Iterator<Item = (f64, DVec3)> + Clone) -> DVec3 {
    let (mut count, mut t_sum, mut p_sum) = (0.0, 0.0, DVec3::ZERO);
    let first_s = samples.clone().next().map_or(0.0, |s| s.0);
    for (t, p) in samples.clone() {
        (count, t_sum, p_sum) = (count + 1.0, t_sum + (t - first_s), p_sum + p);
    }
    let (t_mean, p_mean) = (t_sum / count, p_sum / count);
    let (mut cross, mut spread) = (DVec3::ZERO, 0.0);
    for (t, p) in samples {
        let dt = t - first_s - t_mean;
        cross += dt * (p - p_mean);
        spread += dt * dt;
    }
    if spread > 0.0 {
        cross / spread
    } else {
        DVec3::ZERO
    }
}
