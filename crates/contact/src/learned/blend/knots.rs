//! Knots of the time left, at which parameters are learned.

/// Number of knots.
pub(in crate::learned) const KNOTS: usize = 6;
/// Offset in the logarithm by which times left are compared, s.
const TIME_OFFSET_S: f64 = 0.02;

/// Transformed time left for comparisons, dimensionless.
pub(in crate::learned) fn time_key(left_s: f64) -> f64 {
    (left_s.max(0.0) + TIME_OFFSET_S).ln()
}

/// Weights of the knots on both sides of a time left: they add up to 1.
pub(in crate::learned) fn between_knots(knots: &[f64; KNOTS], key: f64) -> [f64; KNOTS] {
    let mut out = [0.0; KNOTS];
    let above = knots.iter().position(|k| *k > key);
    match above {
        Some(0) => out[0] = 1.0,
        None => out[KNOTS - 1] = 1.0,
        Some(k) => {
            let share = (key - knots[k - 1]) / (knots[k] - knots[k - 1]).max(1e-12);
            (out[k - 1], out[k]) = (1.0 - share, share);
        }
    }
    out
}

/// The knot with the largest weight.
pub(in crate::learned) fn nearest_knot(hats: &[f64; KNOTS]) -> usize {
    let mut nearest = 0;
    for k in 1..KNOTS {
        if hats[k] > hats[nearest] {
            nearest = k;
        }
    }
    nearest
}
