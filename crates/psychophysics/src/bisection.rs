//! Roots by bisection.

const MOST_HALVINGS: usize = 200;

/// Root of a decreasing function, to within `accuracy(high)`.
pub(crate) fn halved(
    [mut low, mut high]: [f64; 2],
    of: impl Fn(f64) -> f64,
    accuracy: impl Fn(f64) -> f64,
) -> f64 {
    for _ in 0..MOST_HALVINGS {
        let middle = 0.5 * (low + high);
        if of(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
        if high - low <= accuracy(high) {
            break;
        }
    }
    0.5 * (low + high)
}
