//! The few dense decompositions that training needs, on row-major slices.

use crate::BipError;
use faer::Mat;

/// Thin singular value decomposition `A = left · diag(singular) · rightᵀ`.
pub(crate) struct Svd {
    /// `rows × k`, row-major, `k = min(rows, columns)`.
    pub(crate) left: Vec<f64>,
    /// Singular values, not negative, largest first.
    pub(crate) singular: Vec<f64>,
    /// `columns × k`, row-major.
    pub(crate) right: Vec<f64>,
}

impl Svd {
    /// Of a finite row-major matrix.
    pub(crate) fn of(rows: usize, columns: usize, a: &[f64]) -> Result<Self, BipError> {
        let matrix = Mat::from_fn(rows, columns, |i, j| a[i * columns + j]);
        let svd = matrix
            .thin_svd()
            .map_err(|_| BipError::NotConverged { rows, columns })?;
        let k = rows.min(columns);
        Ok(Self {
            left: row_major(rows, k, |i, j| svd.U()[(i, j)]),
            singular: (0..k).map(|i| svd.S()[i]).collect(),
            right: row_major(columns, k, |i, j| svd.V()[(i, j)]),
        })
    }

    /// Number of singular values above `tolerance` times the largest.
    pub(crate) fn rank(&self, tolerance: f64) -> usize {
        let largest = self.singular.first().copied().unwrap_or(0.0);
        self.singular
            .iter()
            .take_while(|s| **s > tolerance * largest)
            .count()
    }
}

fn row_major(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    (0..rows * columns)
        .map(|at| entry(at / columns, at % columns))
        .collect()
}

/// Sum of products of two slices of equal length.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Lower Cholesky factor in place, row-major `n × n`, upper triangle ignored.
///
/// `what` names the matrix in the error.
pub(crate) fn cholesky(what: &'static str, n: usize, a: &mut [f64]) -> Result<(), BipError> {
    for i in 0..n {
        for j in 0..=i {
            let sum = a[i * n + j] - dot(&a[i * n..i * n + j], &a[j * n..j * n + j]);
            if i == j {
                // A pivot at the level of rounding is no pivot; written so that NaN fails too.
                let positive = sum > 1e-14 * a[i * n + i].abs();
                if !(positive && sum.is_finite()) {
                    return Err(BipError::NotPositiveDefinite {
                        what,
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
