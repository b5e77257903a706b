//! Motions and noise for the tests.

use glam::DVec3;
use hwall_testkit::Sampler;

/// Completed share of a minimum-jerk motion after a share of its time.
pub(crate) fn minimum_jerk(tau: f64) -> f64 {
    let t = tau.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

/// Standard normal noise in each axis.
pub(crate) fn gaussian(sampler: &mut Sampler) -> DVec3 {
    DVec3::from_array([0; 3].map(|_| sampler.normal()))
}
