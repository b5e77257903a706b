//! Motions of hands.

/// Completed share of a minimum-jerk motion after a share of its time.
#[must_use]
pub fn minimum_jerk(tau: f64) -> f64 {
    let t = tau.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}
