//! Symmetric positive definite systems.

use super::matrix::add_multiple;
use super::{Matrix, dot};
use std::fmt;

/// A matrix without a Cholesky factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NotPositiveDefinite {
    /// Row of the pivot that is not positive, from 0.
    pub pivot: usize,
    /// The pivot.
    pub value: f64,
}

impl fmt::Display for NotPositiveDefinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pivot, value } = self;
        write!(f, "not positive definite: pivot {pivot} is {value}")
    }
}

impl std::error::Error for NotPositiveDefinite {}

/// `A = L Lᵀ` of a symmetric positive definite matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Cholesky {
    lower: Matrix,
}

impl Cholesky {
    /// Factors a square matrix; does not read its upper triangle.
    ///
    /// Error: backward error within `n ε ‖A‖` [Higham 2002, theorem 10.3].
    ///
    /// # Errors
    /// A pivot below 1e-14 of its diagonal entry, or NaN.
    ///
    /// # Panics
    /// If the matrix is not square.
    pub fn new(a: &Matrix) -> Result<Self, NotPositiveDefinite> {
        let n = a.rows();
        assert_eq!(n, a.columns(), "a square matrix");
        let mut lower = Matrix::from_fn(n, n, |i, j| if j <= i { a[(i, j)] } else { 0.0 });
        cholesky_in_place(n, lower.entries_mut())?;
        Ok(Self { lower })
    }

    /// `L`, lower triangular.
    #[must_use]
    pub const fn lower(&self) -> &Matrix {
        &self.lower
    }

    /// `A⁻¹ B`.
    ///
    /// # Panics
    /// If the number of rows of `b` differs from the size of the matrix.
    #[must_use]
    pub fn solve(&self, b: &Matrix) -> Matrix {
        let n = self.lower.rows();
        assert_eq!(n, b.rows(), "rows of a right-hand side");
        // Right-hand sides as rows, so that each is contiguous in memory.
        let mut x = b.transpose();
        for k in 0..x.rows() {
            solve_lower(self.lower.entries(), x.row_mut(k));
            solve_lower_transposed(self.lower.entries(), x.row_mut(k));
        }
        x.transpose()
    }

    /// Natural logarithm of the determinant of `A`.
    #[must_use]
    pub fn log_determinant(&self) -> f64 {
        let n = self.lower.rows();
        2.0 * (0..n).map(|i| self.lower[(i, i)].ln()).sum::<f64>()
    }
}

/// Replaces the lower triangle of a symmetric positive definite `n × n` matrix (row-major) by its Cholesky
/// factor; the upper triangle is neither read nor written. Does not allocate.
///
/// Error: as [`Cholesky::new`].
///
/// # Errors
/// As [`Cholesky::new`]; the triangle is then invalid.
///
/// # Panics
/// If there are fewer than `n * n` entries.
pub fn cholesky_in_place(n: usize, a: &mut [f64]) -> Result<(), NotPositiveDefinite> {
    for i in 0..n {
        for j in 0..=i {
            let sum = a[i * n + j] - dot(&a[i * n..][..j], &a[j * n..][..j]);
            if i == j {
                // Reject a pivot at the level of rounding; NaN fails too.
                let positive = sum > 1e-14 * a[i * n + i].abs();
                if !(positive && sum.is_finite()) {
                    return Err(NotPositiveDefinite {
                        pivot: i,
                        value: sum,
                    });
                }
                a[i * n + i] = sum.sqrt();
            } else {
                a[i * n + j] = sum / a[j * n + j];
            }
        }
    }
    Ok(())
}

/// Solves `L x = b` in place; `lower` is `n × n`, row-major, `n` the length of `b`. The upper
/// triangle is not read.
///
/// # Panics
/// If `lower` has fewer than `n * n` entries.
pub fn solve_lower(lower: &[f64], b: &mut [f64]) {
    let n = b.len();
    for i in 0..n {
        let row = &lower[i * n..(i + 1) * n];
        b[i] = (b[i] - dot(&row[..i], &b[..i])) / row[i];
    }
}

/// Solves `Lᵀ x = b` in place; see [`solve_lower`].
///
/// # Panics
/// If `lower` has fewer than `n * n` entries.
pub fn solve_lower_transposed(lower: &[f64], b: &mut [f64]) {
    let n = b.len();
    for i in (0..n).rev() {
        let row = &lower[i * n..(i + 1) * n];
        let value = b[i] / row[i];
        b[i] = value;
        add_multiple(&mut b[..i], -value, row);
    }
}
