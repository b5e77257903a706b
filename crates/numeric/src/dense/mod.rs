//! Small dense matrices and their decompositions.

mod cholesky;
mod eigen;
mod matrix;
mod svd;

pub use cholesky::{
    Cholesky, NotPositiveDefinite, cholesky_in_place, solve_lower, solve_lower_transposed,
};
pub use eigen::{Eigen, SymmetricEigen, symmetric_eigen};
pub use matrix::Matrix;
pub use svd::{NotConverged, Svd};

/// Dot product of two slices of equal length, with four independent accumulators.
#[must_use]
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a4, a_rest) = a.as_chunks::<4>();
    let (b4, b_rest) = b.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (x, y) in a4.iter().zip(b4) {
        for l in 0..4 {
            sums[l] += x[l] * y[l];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}
