//! The same functions in coordinates in which they are orthonormal over the motion.

use crate::dense::Svd;
use crate::{Basis, BipError};

/// Phases over which the functions are made orthonormal.
const GRID: usize = 257;
/// Directions below this share of the largest singular value are dropped: the rounding of the
/// basis functions, 1e-16, would grow past 1e-6 in them.
const DEPENDENT: f64 = 1e-10;

/// A basis `Φ` and the change of coordinates `Ψ = Φ T` with `mean(Ψᵀ Ψ) = 1` on `[0, 1]`.
///
/// Weights of `Ψ` are of the size of the data whatever the condition number of `Φ`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OrthonormalBasis {
    basis: Basis,
    size: usize,
    condition: f64,
    /// `T`, basis functions × size, row-major.
    transform: Vec<f64>,
    /// Left inverse of `T`, size × basis functions, row-major.
    inverse: Vec<f64>,
}

impl OrthonormalBasis {
    pub(crate) fn new(basis: Basis) -> Result<Self, BipError> {
        basis.validate()?;
        let count = basis.count();
        let grid = GRID.max(4 * count + 1);
        let mut rows = basis.on_grid(grid);
        let scale = 1.0 / (grid as f64).sqrt();
        rows.iter_mut().for_each(|v| *v *= scale);
        let svd = Svd::of(grid, count, &rows)?;
        let size = svd.rank(DEPENDENT);
        let smallest = svd.singular[count - 1];
        let mut transform = vec![0.0; count * size];
        let mut inverse = vec![0.0; size * count];
        for i in 0..count {
            for j in 0..size {
                let v = svd.right[i * count + j];
                transform[i * size + j] = v / svd.singular[j];
                inverse[j * count + i] = v * svd.singular[j];
            }
        }
        Ok(Self {
            basis,
            size,
            condition: if smallest > 0.0 {
                svd.singular[0] / smallest
            } else {
                f64::INFINITY
            },
            transform,
            inverse,
        })
    }

    /// The functions as the user named them.
    pub(crate) fn basis(&self) -> Basis {
        self.basis
    }

    /// Number of independent functions.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Condition number of the functions as the user named them.
    pub(crate) fn condition(&self) -> f64 {
        self.condition
    }

    /// `Ψ` and its derivative at a finite phase; `scratch` holds twice the basis functions.
    pub(crate) fn evaluate_into(
        &self,
        phase: f64,
        scratch: &mut [f64],
        values: &mut [f64],
        derivatives: &mut [f64],
    ) {
        let (raw, raw_derivatives) = scratch.split_at_mut(self.basis.count());
        self.basis
            .fill(phase, raw, &mut raw_derivatives[..self.basis.count()]);
        values.fill(0.0);
        derivatives.fill(0.0);
        for (i, row) in self.transform.chunks_exact(self.size).enumerate() {
            for (j, t) in row.iter().enumerate() {
                values[j] += raw[i] * t;
                derivatives[j] += raw_derivatives[i] * t;
            }
        }
    }

    /// Weights of `Φ` from weights of `Ψ`.
    pub(crate) fn named_weights(&self, weights: &[f64]) -> Vec<f64> {
        self.transform
            .chunks_exact(self.size)
            .map(|row| crate::dense::dot(row, weights))
            .collect()
    }

    /// Weights of `Ψ` from weights of `Φ`.
    pub(crate) fn orthonormal_weights(&self, weights: &[f64]) -> Vec<f64> {
        self.inverse
            .chunks_exact(self.basis.count())
            .map(|row| crate::dense::dot(row, weights))
            .collect()
    }
}
