//! Angles on the circle.

use std::f64::consts::{PI, TAU};

/// The same direction in `(-π, π]`, rad. NaN and infinity give NaN.
///
/// Error: below 1e-15 for angles within a few turns.
#[must_use]
pub fn wrapped_rad(angle_rad: f64) -> f64 {
    if -PI < angle_rad && angle_rad <= PI {
        return angle_rad;
    }
    let turned = angle_rad - TAU * (angle_rad / TAU).round();
    // Correct rounding; NaN stays NaN.
    if turned <= -PI || turned > PI {
        PI
    } else {
        turned
    }
}
