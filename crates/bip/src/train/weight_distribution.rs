//! Mean and covariance factor of the weights of several demonstrations.

use super::fit::{Centred, NEGLIGIBLE};
use crate::error::BipError;
use crate::model::WeightLayout;
use hwall_numeric::dense::{Matrix, Svd, dot};

/// Below this, only the left-out demonstration moves in its direction.
const ALONE: f64 = 1e-10;

/// Mean and factor `F` with `F Fᵀ` the covariance (with `demonstrations - 1`) of the weights.
#[derive(Debug, Clone)]
pub(super) struct WeightDistribution {
    pub mean: Vec<f64>,
    /// Weights × rank.
    pub factor: Matrix,
    /// `V`, demonstrations × rank: the weights of demonstration `i` are the mean plus `√(demonstrations - 1) F vᵢ`, unless directions were dropped.
    /// No rows if unknown.
    right: Matrix,
}

impl WeightDistribution {
    /// From the demonstrations of all fits.
    pub(super) fn of(fits: &[&Centred<'_>], layout: &WeightLayout) -> Result<Self, BipError> {
        let one_group = vec![0; fits.len()];
        let mut all = Self::within_groups(fits, &one_group, 1, layout)?;
        Ok(all.swap_remove(0))
    }

    /// One mean per group, all with the covariance around the group means (with `demonstrations - groups`). `labels` are 0 .. groups - 1, each of
    /// them used.
    pub(super) fn within_groups(
        fits: &[&Centred<'_>],
        labels: &[usize],
        groups: usize,
        layout: &WeightLayout,
    ) -> Result<Vec<Self>, BipError> {
        let (n, weights) = (fits.len(), layout.weights());
        let mut means = vec![vec![0.0; weights]; groups];
        let mut sizes = vec![0.0; groups];
        for label in labels {
            sizes[*label] += 1.0;
        }
        for (fit, &label) in fits.iter().zip(labels) {
            for (mean, w) in means[label].iter_mut().zip(&fit.weights) {
                *mean += w / sizes[label];
            }
        }
        let (mut factor, mut right) = (Matrix::zeros(weights, 0), Matrix::zeros(0, 0));
        if n > groups {
            let share = 1.0 / ((n - groups) as f64).sqrt();
            let mut away = Matrix::from_fn(weights, n, |w, i| {
                (fits[i].weights[w] - means[labels[i]][w]) * share
            });
            drop_rounding(&mut away, fits, layout);
            (factor, right) = strongest(away, layout)?;
        }
        let distribution = |mean| {
            let mut distribution = Self {
                mean,
                factor: factor.clone(),
                right: right.clone(),
            };
            // Each subtracted mean removes a direction.
            distribution.truncate(n - groups);
            distribution
        };
        Ok(means.into_iter().map(distribution).collect())
    }

    /// A distribution of rank 0.
    fn certain(mean: Vec<f64>) -> Self {
        Self {
            factor: Matrix::zeros(mean.len(), 0),
            right: Matrix::zeros(0, 0),
            mean,
        }
    }

    pub(super) fn rank(&self) -> usize {
        self.factor.columns()
    }

    /// Keeps the strongest directions only.
    pub(super) fn truncate(&mut self, rank: usize) {
        if rank < self.rank() {
            let kept = |m: &Matrix| Matrix::from_fn(m.rows(), rank, |i, j| m[(i, j)]);
            self.factor = kept(&self.factor);
            self.right = kept(&self.right);
        }
    }

    /// Mean and covariance of the other demonstrations, from those of all `n` without another decomposition; invalid after directions were dropped.
    ///
    /// With `v` the row of `V`, the covariance of the others is
    /// `(n-1)/(n-2) F (1 - n/(n-1) v vᵀ) Fᵀ`, and `1 - γ v vᵀ` is the square of `1 - β v vᵀ`.
    pub(super) fn without(&self, left_out: usize, fit: &Centred<'_>, n: usize) -> Self {
        let others = (n - 1) as f64;
        let mean: Vec<f64> = self
            .mean
            .iter()
            .zip(&fit.weights)
            .map(|(mean, w)| mean - (w - mean) / others)
            .collect();
        if n == 2 || self.rank() == 0 {
            return Self::certain(mean);
        }
        let v = self.right.row(left_out);
        let square = dot(v, v);
        let kept = 1.0 - n as f64 / others * square;
        let root = if kept > ALONE { kept.sqrt() } else { 0.0 };
        let beta = if square > 0.0 {
            (1.0 - root) / square
        } else {
            0.0
        };
        let scale = (others / (others - 1.0)).sqrt();
        let mut factor = self.factor.clone();
        for w in 0..factor.rows() {
            let row = factor.row_mut(w);
            let along = beta * dot(row, v);
            for (f, v) in row.iter_mut().zip(v) {
                *f = scale * (*f - along * v);
            }
        }
        Self {
            mean,
            right: Matrix::zeros(0, factor.columns()),
            factor,
        }
    }
}

/// Equal demonstrations differ by rounding, which is not a direction of motion: degrees of freedom that differ by no more than rounding are taken
/// as equal.
fn drop_rounding(away: &mut Matrix, fits: &[&Centred<'_>], layout: &WeightLayout) {
    for d in 0..layout.dofs() {
        let range = layout.range(d);
        let weight = fits
            .iter()
            .flat_map(|f| &f.weights[range.clone()])
            .fold(0.0, |m: f64, w| m.max(w.abs()));
        let value = fits.iter().fold(0.0, |m: f64, f| {
            let column = &f.fit.columns[d];
            m.max(column.low.abs()).max(column.high.abs())
        });
        let block = rows_mut(away, range);
        if dot(block, block).sqrt() <= (1e-13 * weight).max(1e-14 * value) {
            block.fill(0.0);
        }
    }
}

/// Consecutive rows.
fn rows_mut(matrix: &mut Matrix, rows: std::ops::Range<usize>) -> &mut [f64] {
    let columns = matrix.columns();
    &mut matrix.entries_mut()[rows.start * columns..rows.end * columns]
}

/// Factors `(F, V)`, `F Vᵀ` the matrix, which has one row per weight; strongest direction first.
///
/// Strength is relative to the spread of each degree of freedom: otherwise radians would be negligible next to millimetres, and their directions
/// would be dropped.
fn strongest(mut matrix: Matrix, layout: &WeightLayout) -> Result<(Matrix, Matrix), BipError> {
    let mut scale = vec![0.0; matrix.rows()];
    for d in 0..layout.dofs() {
        let block = rows_mut(&mut matrix, layout.range(d));
        let spread = dot(block, block).sqrt();
        if spread > 0.0 {
            scale[layout.range(d)].fill(spread);
            block.iter_mut().for_each(|x| *x /= spread);
        }
    }
    let svd = Svd::thin(&matrix)?;
    let rank = svd.rank(NEGLIGIBLE);
    let factor = Matrix::from_fn(matrix.rows(), rank, |w, j| {
        scale[w] * svd.left[(w, j)] * svd.singular[j]
    });
    let right = Matrix::from_fn(matrix.columns(), rank, |i, j| svd.right[(i, j)]);
    Ok((factor, right))
}
