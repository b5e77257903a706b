//! The same functions in coordinates in which they are orthonormal over the motion.

use crate::dense::Svd;
use crate::{Basis, BipError};

/// Phases over which the functions are made orthonormal.
const GRID: usize = 257;
/// Directions below this share of the largest singular value are dropped: the rounding of the
/// basis functions, 1e-16, would grow past 1e-6 in them.
const DEPENDENT: f64 = 1e-10;
/// Stored functions may be this far from orthonormal: rounding over [`DEPENDENT`], with a margin
/// for exponential functions of other machines.
#[cfg(feature = "serde")]
const STORED: f64 = 1e-4;

/// Phases for so many functions.
fn grid(count: usize) -> usize {
    GRID.max(4 * count + 1)
}

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
        let grid = grid(count);
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

    /// As it was stored: the same functions on every machine, whatever signs and last digits its
    /// decomposition has.
    #[cfg(feature = "serde")]
    pub(crate) fn stored(
        basis: Basis,
        size: usize,
        condition: f64,
        transform: Vec<f64>,
        inverse: Vec<f64>,
    ) -> Result<Self, BipError> {
        use crate::error::{finite, length};
        basis.validate()?;
        let count = basis.count();
        if size == 0 || size > count {
            return Err(BipError::Parameter {
                what: "independent functions",
                value: size as f64,
                wanted: "at least 1, at most those of the basis",
            });
        }
        length("transform", count * size, transform.len())?;
        length("inverse", count * size, inverse.len())?;
        finite("transform", &transform)?;
        finite("inverse", &inverse)?;
        if condition.is_nan() || condition < 1.0 {
            return Err(BipError::Parameter {
                what: "condition number",
                value: condition,
                wanted: "at least 1",
            });
        }
        let stored = Self {
            basis,
            size,
            condition,
            transform,
            inverse,
        };
        let deviation = stored.deviation();
        if deviation <= STORED {
            Ok(stored)
        } else {
            Err(BipError::FileBasis { deviation })
        }
    }

    /// How far the functions are from orthonormal, and the inverse from one.
    #[cfg(feature = "serde")]
    fn deviation(&self) -> f64 {
        let (count, size) = (self.basis.count(), self.size);
        let grid = grid(count);
        let rows = self.basis.on_grid(grid);
        let mut products = vec![0.0; size * size];
        for row in rows.chunks_exact(count) {
            let values: Vec<f64> = (0..size)
                .map(|j| {
                    (0..count)
                        .map(|i| row[i] * self.transform[i * size + j])
                        .sum()
                })
                .collect();
            for (j, v) in values.iter().enumerate() {
                for (p, u) in products[j * size..].iter_mut().zip(&values) {
                    *p += v * u / grid as f64;
                }
            }
        }
        let mut largest: f64 = 0.0;
        for j in 0..size {
            for k in 0..size {
                let one = if j == k { 1.0 } else { 0.0 };
                let (mut inverse, mut sizes) = (0.0, 0.0);
                for i in 0..count {
                    let term = self.inverse[j * count + i] * self.transform[i * size + k];
                    inverse += term;
                    sizes += term.abs();
                }
                let apart = [
                    products[j * size + k] - one,
                    (inverse - one) / sizes.max(1.0),
                ];
                for x in apart {
                    // NaN is as far away as can be.
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

    /// `T`, basis functions × size, row-major.
    #[cfg(feature = "serde")]
    pub(crate) fn transform(&self) -> &[f64] {
        &self.transform
    }

    /// Left inverse of `T`, size × basis functions, row-major.
    #[cfg(feature = "serde")]
    pub(crate) fn inverse(&self) -> &[f64] {
        &self.inverse
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
