//! Mean and covariance factor of the weights of several demonstrations.

use crate::BipError;
use crate::dense::{Svd, dot};
use crate::fit::{Centred, NEGLIGIBLE};
use crate::model::DofLayout;
use crate::orthonormal::OrthonormalBasis;

/// Below this the demonstration left out was the only one with its direction.
const ALONE: f64 = 1e-10;

/// Mean and factor `F` with `F Fᵀ` the covariance (with `demonstrations - 1`) of the weights.
#[derive(Debug, Clone)]
pub(crate) struct Spread {
    pub(crate) mean: Vec<f64>,
    /// Weights × rank, row-major.
    pub(crate) factor: Vec<f64>,
    pub(crate) rank: usize,
    /// `V`, demonstrations × rank, row-major: the weights of demonstration `i` are the mean and
    /// `√(demonstrations - 1) F vᵢ`, unless directions were dropped.
    right: Vec<f64>,
}

impl Spread {
    pub(crate) fn of(
        fits: &[&Centred<'_>],
        layout: &[DofLayout],
        bases: &[OrthonormalBasis],
    ) -> Result<Self, BipError> {
        let (n, weights) = (fits.len(), fits[0].weights.len());
        let mean: Vec<f64> = (0..weights)
            .map(|w| fits.iter().map(|f| f.weights[w] / n as f64).sum())
            .collect();
        if n == 1 {
            return Ok(Self {
                mean,
                factor: Vec::new(),
                rank: 0,
                right: Vec::new(),
            });
        }
        let mut away = vec![0.0; weights * n];
        let share = 1.0 / ((n - 1) as f64).sqrt();
        for (w, (row, mean)) in away.chunks_exact_mut(n).zip(&mean).enumerate() {
            for (a, fit) in row.iter_mut().zip(fits) {
                *a = (fit.weights[w] - mean) * share;
            }
        }
        drop_rounding(&mut away, fits, layout, bases);
        let (factor, right, rank) = strongest(&away, n, layout, bases)?;
        let mut spread = Self {
            mean,
            factor,
            rank,
            right,
        };
        // The mean was taken away: a further direction is rounding.
        spread.truncate(n - 1);
        Ok(spread)
    }

    /// One mean a group, all with the covariance around the means of their groups (with
    /// `demonstrations - groups`). `labels` are 0 .. groups - 1, every one of them taken.
    pub(crate) fn within_groups(
        fits: &[&Centred<'_>],
        labels: &[usize],
        groups: usize,
        layout: &[DofLayout],
        bases: &[OrthonormalBasis],
    ) -> Result<Vec<Self>, BipError> {
        let (n, weights) = (fits.len(), fits[0].weights.len());
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
        let (mut factor, mut rank) = (Vec::new(), 0);
        if n > groups {
            let share = 1.0 / ((n - groups) as f64).sqrt();
            let mut away = vec![0.0; weights * n];
            for (w, row) in away.chunks_exact_mut(n).enumerate() {
                for ((a, fit), &label) in row.iter_mut().zip(fits).zip(labels) {
                    *a = (fit.weights[w] - means[label][w]) * share;
                }
            }
            drop_rounding(&mut away, fits, layout, bases);
            (factor, _, rank) = strongest(&away, n, layout, bases)?;
        }
        let spread = |mean| {
            let mut spread = Self {
                mean,
                factor: factor.clone(),
                rank,
                right: Vec::new(),
            };
            // Every mean that was taken away costs a direction.
            spread.truncate(n - groups);
            spread
        };
        Ok(means.into_iter().map(spread).collect())
    }

    /// The same with the strongest directions only.
    pub(crate) fn truncate(&mut self, rank: usize) {
        if rank < self.rank {
            let keep = |matrix: &[f64], from: usize| -> Vec<f64> {
                matrix
                    .chunks_exact(from)
                    .flat_map(|row| &row[..rank])
                    .copied()
                    .collect()
            };
            self.factor = keep(&self.factor, self.rank);
            self.right = keep(&self.right, self.rank);
            self.rank = rank;
        }
    }

    /// Mean and covariance of the others, from those of all `fits` and without another
    /// decomposition; not for a spread from which directions were dropped.
    ///
    /// With `v` the row of `V`, the covariance of the others is
    /// `(n-1)/(n-2) F (1 - n/(n-1) v vᵀ) Fᵀ`, and `1 - γ v vᵀ` is the square of `1 - β v vᵀ`.
    pub(crate) fn without(&self, left_out: usize, fit: &Centred<'_>, n: usize) -> Self {
        let others = (n - 1) as f64;
        let mean: Vec<f64> = self
            .mean
            .iter()
            .zip(&fit.weights)
            .map(|(mean, w)| mean - (w - mean) / others)
            .collect();
        if n == 2 || self.rank == 0 {
            return Self {
                mean,
                factor: Vec::new(),
                rank: 0,
                right: Vec::new(),
            };
        }
        let v = &self.right[left_out * self.rank..][..self.rank];
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
        for row in factor.chunks_exact_mut(self.rank) {
            let along = beta * dot(row, v);
            for (f, v) in row.iter_mut().zip(v) {
                *f = scale * (*f - along * v);
            }
        }
        Self {
            mean,
            factor,
            rank: self.rank,
            right: Vec::new(),
        }
    }

    /// With the covariance `(1 - α) S + α T`, `T` the blocks of `S` of the single degrees of
    /// freedom.
    pub(crate) fn shrunk(
        &self,
        alpha: f64,
        layout: &[DofLayout],
        bases: &[OrthonormalBasis],
    ) -> Result<Self, BipError> {
        if alpha == 0.0 || self.rank == 0 {
            return Ok(self.clone());
        }
        let mut blocks = Vec::with_capacity(layout.len());
        for dof in layout {
            let size = bases[dof.group].size();
            let rows = &self.factor[dof.first_weight * self.rank..][..size * self.rank];
            blocks.push((size, Svd::of(size, self.rank, rows)?));
        }
        let own: usize = blocks.iter().map(|(_, svd)| svd.singular.len()).sum();
        let all = if alpha < 1.0 { self.rank } else { 0 };
        let width = all + own;
        let mut wide = vec![0.0; self.mean.len() * width];
        let mut column = all;
        for (dof, (size, svd)) in layout.iter().zip(&blocks) {
            let stride = svd.singular.len();
            for j in 0..*size {
                let w = dof.first_weight + j;
                let row = &mut wide[w * width..(w + 1) * width];
                for (to, from) in row[..all].iter_mut().zip(&self.factor[w * self.rank..]) {
                    *to = (1.0 - alpha).sqrt() * from;
                }
                for (c, s) in svd.singular.iter().enumerate() {
                    row[column + c] = alpha.sqrt() * svd.left[j * stride + c] * s;
                }
            }
            column += stride;
        }
        let (factor, _, rank) = strongest(&wide, width, layout, bases)?;
        Ok(Self {
            mean: self.mean.clone(),
            factor,
            rank,
            right: Vec::new(),
        })
    }
}

/// Equal demonstrations differ by rounding, which is no direction of motion: where a degree of
/// freedom differs by no more, it does not differ.
fn drop_rounding(
    away: &mut [f64],
    fits: &[&Centred<'_>],
    layout: &[DofLayout],
    bases: &[OrthonormalBasis],
) {
    for (d, dof) in layout.iter().enumerate() {
        let rows = dof.first_weight..dof.first_weight + bases[dof.group].size();
        let block = &mut away[rows.start * fits.len()..rows.end * fits.len()];
        let weight = fits
            .iter()
            .flat_map(|f| &f.weights[rows.clone()])
            .fold(0.0, |m: f64, w| m.max(w.abs()));
        let value = fits.iter().fold(0.0, |m: f64, f| {
            let column = &f.fit.columns[d];
            m.max(column.low.abs()).max(column.high.abs())
        });
        if dot(block, block).sqrt() <= (1e-13 * weight).max(1e-14 * value) {
            block.fill(0.0);
        }
    }
}

/// `factor · rightᵀ` of a matrix with one row a weight, strongest direction first.
///
/// Strong is meant relative to the spread of each degree of freedom: otherwise radians would
/// vanish beside millimetres when small directions are dropped.
fn strongest(
    matrix: &[f64],
    columns: usize,
    layout: &[DofLayout],
    bases: &[OrthonormalBasis],
) -> Result<(Vec<f64>, Vec<f64>, usize), BipError> {
    let weights = matrix.len() / columns;
    let mut scaled = matrix.to_vec();
    let mut scale = vec![0.0; weights];
    for dof in layout {
        let rows = dof.first_weight..dof.first_weight + bases[dof.group].size();
        let block = &mut scaled[rows.start * columns..rows.end * columns];
        let spread = dot(block, block).sqrt();
        if spread > 0.0 {
            scale[rows].fill(spread);
            block.iter_mut().for_each(|x| *x /= spread);
        }
    }
    let svd = Svd::of(weights, columns, &scaled)?;
    let rank = svd.rank(NEGLIGIBLE);
    let stride = svd.singular.len();
    let mut factor = Vec::with_capacity(weights * rank);
    for (row, scale) in svd.left.chunks_exact(stride).zip(&scale) {
        factor.extend(
            row.iter()
                .zip(&svd.singular)
                .take(rank)
                .map(|(u, s)| scale * u * s),
        );
    }
    let right = svd
        .right
        .chunks_exact(stride)
        .flat_map(|row| &row[..rank])
        .copied()
        .collect();
    Ok((factor, right, rank))
}
