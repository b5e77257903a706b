//! Least-squares fit of one demonstration, stored so that an offset can be chosen later.

use super::demonstration::Demonstration;
use crate::basis::OrthonormalBasis;
use crate::error::BipError;
use crate::model::WeightLayout;
use hwall_numeric::dense::{Matrix, Svd, dot};

/// Directions below this share of the largest are rounding, not data.
pub(super) const NEGLIGIBLE: f64 = 1e-12;

/// All training data of one demonstration.
///
/// The fit is linear: with `m` the mean of a degree of freedom over this demonstration, the weights of `x - o` are those of `x - m` plus `(m - o)`
/// times those of the constant 1. When other demonstrations change the offset `o`, no fit has to be repeated. (Subtracting `m` first keeps
/// precision for data far from zero.)
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub samples: usize,
    /// Time from the first to the last sample.
    pub duration: f64,
    /// One per degree of freedom.
    pub columns: Vec<Column>,
    pub groups: Vec<GroupFit>,
    /// Weights of the values minus their own means.
    weights: Vec<f64>,
}

/// One degree of freedom over one demonstration.
#[derive(Debug, Clone)]
pub(super) struct Column {
    pub mean: f64,
    pub low: f64,
    pub high: f64,
    /// Mean squared residual of the values minus their mean.
    residual: f64,
    /// Mean product of that residual with the residual of the constant 1.
    cross: f64,
}

impl Column {
    /// Without the residuals, which are set later.
    fn of(values: impl ExactSizeIterator<Item = f64>) -> Self {
        let mut column = Self {
            mean: 0.0,
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
            residual: 0.0,
            cross: 0.0,
        };
        let samples = values.len() as f64;
        for x in values {
            // Divide first: a sum of values near the largest double would overflow.
            column.mean += x / samples;
            column.low = column.low.min(x);
            column.high = column.high.max(x);
        }
        column
    }
}

/// Common data of the degrees of freedom of a group.
#[derive(Debug, Clone)]
pub(super) struct GroupFit {
    /// `G` with `Gᵀ G = Ψᵀ Ψ` over the samples: size × size.
    pub compact: Matrix,
    /// Weights of the constant 1.
    constant: Vec<f64>,
    /// Mean squared residual of the constant 1; zero in a basis that contains it.
    constant_residual: f64,
}

impl GroupFit {
    /// Number of functions that the samples resolve. The lengths of the rows of the compact form are the singular values.
    pub(super) fn rank(&self) -> usize {
        let squares: Vec<f64> = (0..self.compact.rows())
            .map(|i| dot(self.compact.row(i), self.compact.row(i)))
            .collect();
        let largest = squares.iter().copied().fold(0.0, f64::max);
        let counts = |s: &&f64| **s > NEGLIGIBLE * NEGLIGIBLE * largest;
        squares.iter().filter(counts).count()
    }
}

impl Fit {
    pub(super) fn of(
        demonstration: &Demonstration,
        layout: &WeightLayout,
    ) -> Result<Self, BipError> {
        let samples = demonstration.len();
        let bases = layout.bases();
        // Groups often share a basis: decompose each basis once.
        let mut designs: Vec<Design> = Vec::new();
        let mut design_of = Vec::with_capacity(bases.len());
        for (group, basis) in bases.iter().enumerate() {
            match bases[..group].iter().position(|b| b == basis) {
                Some(same) => design_of.push(design_of[same]),
                None => {
                    design_of.push(designs.len());
                    designs.push(Design::of(basis, demonstration)?);
                }
            }
        }
        let mut fit = Self {
            samples,
            duration: demonstration.duration(),
            columns: Vec::with_capacity(layout.dofs()),
            groups: design_of.iter().map(|g| designs[*g].group()).collect(),
            weights: vec![0.0; layout.weights()],
        };
        for d in 0..layout.dofs() {
            let values = (0..samples).map(|k| demonstration.sample(k)[d]);
            let mut column = Column::of(values.clone());
            let x: Vec<f64> = values.map(|x| x - column.mean).collect();
            let design = &designs[design_of[layout.group(d)]];
            let w = &mut fit.weights[layout.range(d)];
            design.solve(&x, w);
            for (k, (x, one)) in x.iter().zip(&design.constant_left).enumerate() {
                let left = x - dot(design.rows.row(k), w);
                column.residual += left * left / samples as f64;
                column.cross += left * one / samples as f64;
            }
            fit.columns.push(column);
        }
        Ok(fit)
    }

    /// Mean time between two samples.
    pub(super) fn period(&self) -> f64 {
        self.duration / (self.samples - 1) as f64
    }

    /// Weights and residuals of the values minus an offset.
    pub(super) fn less(&self, offset: &[f64], layout: &WeightLayout) -> Centred<'_> {
        let mut weights = self.weights.clone();
        let mut residual = Vec::with_capacity(layout.dofs());
        for (d, (column, offset)) in self.columns.iter().zip(offset).enumerate() {
            let group = &self.groups[layout.group(d)];
            let shift = column.mean - offset;
            for (w, one) in weights[layout.range(d)].iter_mut().zip(&group.constant) {
                *w += shift * one;
            }
            let squares =
                column.residual + shift * (2.0 * column.cross + shift * group.constant_residual);
            residual.push(squares.max(0.0));
        }
        Centred {
            fit: self,
            weights,
            residual,
        }
    }
}

/// A fit with a known offset.
#[derive(Debug)]
pub(super) struct Centred<'a> {
    pub fit: &'a Fit,
    pub weights: Vec<f64>,
    /// Mean squared residual of each degree of freedom.
    pub residual: Vec<f64>,
}

impl Centred<'_> {
    /// Mean squared residual of degree of freedom `d` with other weights: by least squares, its own residual is orthogonal to the difference.
    pub(super) fn residual_with(&self, d: usize, layout: &WeightLayout, other: &[f64]) -> f64 {
        let away: Vec<f64> = other
            .iter()
            .zip(&self.weights[layout.range(d)])
            .map(|(a, b)| a - b)
            .collect();
        let compact = &self.fit.groups[layout.group(d)].compact;
        let squares: f64 = (0..compact.rows())
            .map(|i| dot(compact.row(i), &away).powi(2))
            .sum();
        self.residual[d] + squares / self.fit.samples as f64
    }
}

/// `Ψ` at the phases of a demonstration, and its pseudo-inverse.
struct Design {
    /// `Ψ`, samples × size.
    rows: Matrix,
    svd: Svd,
    constant: Vec<f64>,
    /// Residual of the constant 1.
    constant_left: Vec<f64>,
}

impl Design {
    fn of(basis: &OrthonormalBasis, demonstration: &Demonstration) -> Result<Self, BipError> {
        let (size, samples) = (basis.size(), demonstration.len());
        let mut rows = Matrix::zeros(samples, size);
        let mut slopes = vec![0.0; size];
        let mut scratch = vec![0.0; basis.scratch_len()];
        for k in 0..samples {
            let phase = demonstration.phase(k);
            basis.evaluate_into(phase, &mut scratch, rows.row_mut(k), &mut slopes);
        }
        let mut design = Self {
            svd: Svd::thin(&rows)?,
            rows,
            constant: vec![0.0; size],
            constant_left: Vec::new(),
        };
        let mut constant = vec![0.0; size];
        design.solve(&vec![1.0; samples], &mut constant);
        design.constant_left = (0..samples)
            .map(|k| 1.0 - dot(design.rows.row(k), &constant))
            .collect();
        design.constant = constant;
        Ok(design)
    }

    /// Minimum-norm least-squares weights of `Ψ w = x`.
    fn solve(&self, x: &[f64], w: &mut [f64]) {
        let svd = &self.svd;
        let mut along = vec![0.0; svd.singular.len()];
        for (k, x) in x.iter().enumerate() {
            for (a, u) in along.iter_mut().zip(svd.left.row(k)) {
                *a += u * x;
            }
        }
        w.fill(0.0);
        for (j, along) in along.iter().enumerate().take(svd.rank(NEGLIGIBLE)) {
            let along = along / svd.singular[j];
            for (i, w) in w.iter_mut().enumerate() {
                *w += svd.right[(i, j)] * along;
            }
        }
    }

    fn group(&self) -> GroupFit {
        let size = self.rows.columns();
        // diag(singular) rightᵀ, padded with zero rows.
        let compact = Matrix::from_fn(size, size, |j, i| {
            let s = self.svd.singular.get(j);
            s.map_or(0.0, |s| s * self.svd.right[(i, j)])
        });
        let left = &self.constant_left;
        GroupFit {
            compact,
            constant: self.constant.clone(),
            constant_residual: dot(left, left) / left.len() as f64,
        }
    }
}
