//! Where a condition changes.

/// Where `before` turns from true to false between `lo` and `hi`, to the last bit or nearly.
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
