//! The basis in coordinates in which it is orthonormal over the motion.

use super::functions::Basis;
use crate::error::BipError;
use hwall_numeric::dense::{Matrix, Svd, dot};

/// Number of phases for the orthonormalisation.
const GRID: usize = 257;
/// Directions below this share of the largest singular value are dropped: along them, the rounding of the basis functions, 1e-16, would grow past
/// 1e-6.
const DEPENDENT: f64 = 1e-10;
/// Largest deviation of stored functions from orthonormality: rounding over [`DEPENDENT`], with a margin for exponential functions of other
/// machines.
#[cfg(feature = "serde")]
const STORED: f64 = 1e-4;
/// Largest deviation of computed functions; directions are dropped until the functions meet it. The margin of ten relative to `STORED` makes files
/// readable on every machine.
const MADE: f64 = 1e-5;

/// Number of phases for this number of functions.
fn grid(count: usize) -> usize {
    GRID.max(4 * count + 1)
}

/// A basis `Φ` and the change of coordinates `Ψ = Φ T` with `mean(Ψᵀ Ψ) = 1` on `[0, 1]`.
///
/// The weights of `Ψ` have the size of the data, for any condition number of `Φ`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OrthonormalBasis {
    basis: Basis,
    size: usize,
    condition: f64,
    /// `T`, basis functions × size.
    transform: Matrix,
    /// Left inverse of `T`, size × basis functions.
    inverse: Matrix,
}

impl OrthonormalBasis {
    pub(crate) fn new(basis: Basis) -> Result<Self, BipError> {
        basis.validate()?;
        let count = basis.count();
        let grid = grid(count);
        let mut rows = basis.on_grid(grid);
        let scale = 1.0 / (grid as f64).sqrt();
        rows.entries_mut().iter_mut().for_each(|v| *v *= scale);
        let svd = Svd::thin(&rows)?;
        let smallest = svd.singular[count - 1];
        let condition = if smallest > 0.0 {
            svd.singular[0] / smallest
        } else {
            f64::INFINITY
        };
        let (right, singular) = (&svd.right, &svd.singular);
        let of_size = |size| Self {
            basis,
            size,
            condition,
            transform: Matrix::from_fn(count, size, |i, j| right[(i, j)] / singular[j]),
            inverse: Matrix::from_fn(size, count, |j, i| right[(i, j)] * singular[j]),
        };
        let mut made = of_size(svd.rank(DEPENDENT));
        // Rounding errors where the functions are steep do not affect the singular values.
        while made.size > 1 && made.deviation() > MADE {
            made = of_size(made.size - 1);
        }
        Ok(made)
    }

    /// From stored values: the same functions on every machine, although signs and last digits of the decomposition differ.
    #[cfg(feature = "serde")]
    pub(crate) fn stored(
        basis: Basis,
        size: usize,
        condition: f64,
        transform: Vec<f64>,
        inverse: Vec<f64>,
    ) -> Result<Self, BipError> {
        use crate::error::length;
        use hwall_numeric::check;
        basis.validate()?;
        let count = basis.count();
        check::that(
            (1..=count).contains(&size),
            "independent functions",
            size as f64,
            "at least 1, at most those of the basis",
        )?;
        length("transform", count * size, transform.len())?;
        length("inverse", count * size, inverse.len())?;
        check::all_finite("transform", &transform)?;
        check::all_finite("inverse", &inverse)?;
        check::that(
            condition >= 1.0,
            "condition number",
            condition,
            "at least 1",
        )?;
        let stored = Self {
            basis,
            size,
            condition,
            transform: Matrix::from_rows(count, size, transform),
            inverse: Matrix::from_rows(size, count, inverse),
        };
        let deviation = stored.deviation();
        if deviation <= STORED {
            Ok(stored)
        } else {
            Err(BipError::FileBasis { deviation })
        }
    }

    /// Largest deviation of the functions from orthonormality, and of the inverse from a left inverse.
    fn deviation(&self) -> f64 {
        let (count, size) = (self.basis.count(), self.size);
        let grid = grid(count);
        let products = self.basis.on_grid(grid).times(&self.transform).gram();
        let mut largest: f64 = 0.0;
        for j in 0..size {
            for k in 0..size {
                let one = if j == k { 1.0 } else { 0.0 };
                let (mut inverse, mut sizes) = (0.0, 0.0);
                for i in 0..count {
                    let term = self.inverse[(j, i)] * self.transform[(i, k)];
                    inverse += term;
                    sizes += term.abs();
                }
                let apart = [
                    products[(j, k)] / grid as f64 - one,
                    (inverse - one) / sizes.max(1.0),
                ];
                for x in apart {
                    // NaN counts as infinite.
                    largest = if x.is_nan() {
                        f64::INFINITY
                    } else {
                        largest.max(x.abs())
                    };
                }
            }
        }
        largest
    }

    /// `T`, basis functions × size.
    #[cfg(feature = "serde")]
    pub(crate) fn transform(&self) -> &Matrix {
        &self.transform
    }

    /// Left inverse of `T`, size × basis functions.
    #[cfg(feature = "serde")]
    pub(crate) fn inverse(&self) -> &Matrix {
        &self.inverse
    }

    /// The basis chosen by the user.
    pub(crate) fn basis(&self) -> Basis {
        self.basis
    }

    /// Number of independent functions.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Condition number of the basis chosen by the user.
    pub(crate) fn condition(&self) -> f64 {
        self.condition
    }

    /// Scratch length for [`evaluate_into`](Self::evaluate_into).
    pub(crate) fn scratch_len(&self) -> usize {
        2 * self.basis.count()
    }

    /// `Ψ` and its derivative at a finite phase; `scratch` has at least [`scratch_len`](Self::scratch_len) entries.
    pub(crate) fn evaluate_into(
        &self,
        phase: f64,
        scratch: &mut [f64],
        values: &mut [f64],
        derivatives: &mut [f64],
    ) {
        let count = self.basis.count();
        let (raw, raw_derivatives) = scratch.split_at_mut(count);
        self.basis.fill(phase, raw, &mut raw_derivatives[..count]);
        values.fill(0.0);
        derivatives.fill(0.0);
        for (i, row) in self.transform.entries().chunks_exact(self.size).enumerate() {
            for (j, t) in row.iter().enumerate() {
                values[j] += raw[i] * t;
                derivatives[j] += raw_derivatives[i] * t;
            }
        }
    }

    /// Weights of `Φ` from weights of `Ψ`.
    pub(crate) fn named_weights(&self, weights: &[f64]) -> Vec<f64> {
        let rows = self.transform.entries().chunks_exact(self.size);
        rows.map(|row| dot(row, weights)).collect()
    }

    /// Weights of `Ψ` from weights of `Φ`.
    pub(crate) fn orthonormal_weights(&self, weights: &[f64]) -> Vec<f64> {
        let rows = self.inverse.entries().chunks_exact(self.basis.count());
        rows.map(|row| dot(row, weights)).collect()
    }
}
