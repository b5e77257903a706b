//! Symmetric positive definite systems.

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
    /// Factors a square matrix; its upper triangle is not read.
    ///
    /// Error: that of a matrix within `n ε ‖A‖` of the one given [Higham 2002, theorem 10.3].
    ///
    /// # Errors
    /// A pivot that is not positive beside its diagonal entry (below 1e-14 of it), or NaN.
    ///
    /// # Panics
    /// If the matrix is not square.
    pub fn new(a: &Matrix) -> Result<Self, NotPositiveDefinite> {
        let n = a.rows();
        assert_eq!(n, a.columns(), "a square matrix");
        let mut lower = Matrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let sum = a[(i, j)] - dot(&lower.row(i)[..j], &lower.row(j)[..j]);
                if i == j {
                    // A pivot at the level of rounding is no pivot; written so that NaN fails too.
                    let positive = sum > 1e-14 * a[(i, i)].abs();
                    if !(positive && sum.is_finite()) {
                        return Err(NotPositiveDefinite {
                            pivot: i,
                            value: sum,
                        });
                    }
                    lower[(i, i)] = sum.sqrt();
                } else {
                    lower[(i, j)] = sum / lower[(j, j)];
                }
            }
        }
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
    /// If `b` has not as many rows as the matrix.
    #[must_use]
    pub fn solve(&self, b: &Matrix) -> Matrix {
        let n = self.lower.rows();
        assert_eq!(n, b.rows(), "rows of a right-hand side");
        // Right-hand sides as rows: each is then solved in contiguous memory.
        let mut x = b.transpose();
        for k in 0..x.rows() {
            let x = x.row_mut(k);
            for i in 0..n {
                let row = self.lower.row(i);
                x[i] = (x[i] - dot(&row[..i], &x[..i])) / row[i];
            }
            for i in (0..n).rev() {
                let row = self.lower.row(i);
                let value = x[i] / row[i];
                x[i] = value;
                for (to, l) in x[..i].iter_mut().zip(row) {
                    *to -= l * value;
                }
            }
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
