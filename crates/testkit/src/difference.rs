//! Derivatives by central differences, to check analytic ones.

use crate::tolerance::Components;
use std::ops::{Mul, Sub};

/// `df/dx` at `x` of a function with values in `f64`, `DVec3`, `DMat3` or the like.
///
/// Error: `h²/6 · f‴` from the step, plus about `1e-16 · |f| / h` from rounding; `h` near
/// `1e-5` times the scale of `x` balances the two at about `1e-11 · |f|`.
#[must_use]
pub fn central_difference<T>(mut f: impl FnMut(f64) -> T, x: f64, h: f64) -> T
where
    T: Sub<Output = T> + Mul<f64, Output = T>,
{
    let (after, before) = (x + h, x - h);
    // Divide by the actual step, after rounding.
    (f(after) - f(before)) * (1.0 / (after - before))
}

/// Derivatives of a function of several variables: `result[j][i] = ∂f_i / ∂x_j`.
///
/// One entry per variable (a column of the Jacobian); `i` runs over the [`Components`] of the value. Error
/// as in [`central_difference`].
///
/// # Panics
/// If `f` returns different numbers of components on the two sides.
#[must_use]
pub fn central_jacobian<V: Components>(
    mut f: impl FnMut(&[f64]) -> V,
    x: &[f64],
    h: f64,
) -> Vec<Vec<f64>> {
    let mut moved = x.to_vec();
    let mut columns = Vec::with_capacity(x.len());
    for (j, &centre) in x.iter().enumerate() {
        let (after, before) = (centre + h, centre - h);
        moved[j] = after;
        let high = f(&moved).components();
        moved[j] = before;
        let low = f(&moved).components();
        moved[j] = centre;
        assert_eq!(
            high.len(),
            low.len(),
            "the function changes its number of components"
        );
        columns.push(
            high.iter()
                .zip(&low)
                .map(|(a, b)| (a - b) / (after - before))
                .collect(),
        );
    }
    columns
}
