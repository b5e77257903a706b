//! Joint vectors.

use hwall_numeric::dense::dot;

/// Sum of squares.
pub(super) fn square(a: &[f64]) -> f64 {
    dot(a, a)
}

/// `to += times * direction`.
pub(super) fn add(to: &mut [f64], direction: &[f64], times: f64) {
    for (x, d) in to.iter_mut().zip(direction) {
        *x += times * d;
    }
}

/// `q + times * direction`.
pub(super) fn offset(q: &[f64], direction: &[f64], times: f64) -> Vec<f64> {
    let mut moved = q.to_vec();
    add(&mut moved, direction, times);
    moved
}
