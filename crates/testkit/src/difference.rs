//! Derivatives by central differences, to check analytic ones.

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
