//! Bisection for the change of a condition.

/// The point between `lo` and `hi` where `before` changes from true to false, nearly to the last bit.
pub(super) fn bisect(mut lo: f64, mut hi: f64, before: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (lo + hi);
        if before(middle) {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    0.5 * (lo + hi)
}
