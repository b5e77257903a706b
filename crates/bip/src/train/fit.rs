//! Least squares of one demonstration, kept so that an offset can be chosen later.

use crate::dense::{Svd, dot};
use crate::model::DofLayout;
use crate::orthonormal::OrthonormalBasis;
use crate::{BipError, Demonstration};

/// Directions below this share of the largest are rounding, not data.
pub(crate) const NEGLIGIBLE: f64 = 1e-12;

/// Everything that training needs of one demonstration.
///
/// The fit is linear: with `m` the mean of a degree of freedom over this demonstration, the
/// weights of `x - o` are those of `x - m` plus `(m - o)` times those of the constant 1. Other
/// demonstrations move the offset `o`, and no fit has to be repeated. (Taking `m` away first
/// keeps the digits of data that lie far from zero.)
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub(crate) samples: usize,
    /// From the first to the last sample.
    pub(crate) duration: f64,
    pub(crate) columns: Vec<Column>,
    pub(crate) groups: Vec<GroupFit>,
    /// Weights of the values less their own means.
    weights: Vec<f64>,
}

/// One degree of freedom over one demonstration.
#[derive(Debug, Clone)]
pub(crate) struct Column {
    pub(crate) mean: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Mean squared residual of the values less their mean.
    residual: f64,
    /// Mean product of that residual with the residual of the constant 1.
    cross: f64,
}

/// What the degrees of freedom of a group share.
#[derive(Debug, Clone)]
pub(crate) struct GroupFit {
    /// `G` with `Gᵀ G = Ψᵀ Ψ` over the samples: size × size, row-major.
    pub(crate) compact: Vec<f64>,
    /// Weights of the constant 1.
    constant: Vec<f64>,
    /// Mean squared residual of the constant 1; zero in a basis that contains it.
    constant_residual: f64,
}

impl Fit {
    pub(crate) fn of(
        demonstration: &Demonstration,
        bases: &[OrthonormalBasis],
        layout: &[DofLayout],
        weights: usize,
    ) -> Result<Self, BipError> {
        let samples = demonstration.len();
        // Groups often share a basis: one decomposition each.
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
            columns: Vec::with_capacity(layout.len()),
            groups: design_of.iter().map(|g| designs[*g].group()).collect(),
            weights: vec![0.0; weights],
        };
        let mut x = vec![0.0; samples];
        for (d, dof) in layout.iter().enumerate() {
            let mut column = Column {
                mean: 0.0,
                low: f64::INFINITY,
                high: f64::NEG_INFINITY,
                residual: 0.0,
                cross: 0.0,
            };
            for (k, x) in x.iter_mut().enumerate() {
                *x = demonstration.sample(k)[d];
                // Divided first: a sum of values near the largest double would overflow.
                column.mean += *x / samples as f64;
                column.low = column.low.min(*x);
                column.high = column.high.max(*x);
            }
            x.iter_mut().for_each(|x| *x -= column.mean);
            let design = &designs[design_of[dof.group]];
            let w = &mut fit.weights[dof.first_weight..][..design.size];
            design.solve(&x, w);
            for ((psi, x), one) in design
                .rows
                .chunks_exact(design.size)
                .zip(&x)
                .zip(&design.left)
            {
                let left = x - dot(psi, w);
                column.residual += left * left / samples as f64;
                column.cross += left * one / samples as f64;
            }
            fit.columns.push(column);
        }
        Ok(fit)
    }

    /// Mean time between two samples.
    pub(crate) fn period(&self) -> f64 {
        self.duration / (self.samples - 1) as f64
    }

    /// Weights and residuals of the values less an offset.
    pub(crate) fn less(&self, offset: &[f64], layout: &[DofLayout]) -> Centred<'_> {
        let mut weights = self.weights.clone();
        let mut residual = Vec::with_capacity(layout.len());
        for ((dof, column), offset) in layout.iter().zip(&self.columns).zip(offset) {
            let group = &self.groups[dof.group];
            let shift = column.mean - offset;
            for (w, one) in weights[dof.first_weight..].iter_mut().zip(&group.constant) {
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

/// A fit after the offset is known.
#[derive(Debug)]
pub(crate) struct Centred<'a> {
    pub(crate) fit: &'a Fit,
    pub(crate) weights: Vec<f64>,
    /// Mean squared residual per degree of freedom.
    pub(crate) residual: Vec<f64>,
}

impl Centred<'_> {
    /// Mean squared residual of a degree of freedom with other weights: the fit is a least-squares
    /// one, so its own residual and the distance to it are perpendicular.
    pub(crate) fn residual_with(&self, d: usize, dof: DofLayout, other: &[f64]) -> f64 {
        let away: Vec<f64> = other
            .iter()
            .zip(&self.weights[dof.first_weight..])
            .map(|(a, b)| a - b)
            .collect();
        let squares: f64 = self.fit.groups[dof.group]
            .compact
            .chunks_exact(other.len())
            .map(|row| dot(row, &away).powi(2))
            .sum();
        self.residual[d] + squares / self.fit.samples as f64
    }
}

/// `Ψ` at the phases of a demonstration, and its pseudo-inverse.
struct Design {
    size: usize,
    /// `Ψ`, samples × size, row-major.
    rows: Vec<f64>,
    svd: Svd,
    constant: Vec<f64>,
    /// Residual of the constant 1.
    left: Vec<f64>,
}

impl Design {
    fn of(basis: &OrthonormalBasis, demonstration: &Demonstration) -> Result<Self, BipError> {
        let (size, samples) = (basis.size(), demonstration.len());
        let mut rows = vec![0.0; samples * size];
        let mut slopes = vec![0.0; size];
        let mut scratch = vec![0.0; 2 * basis.basis().count()];
        for (k, row) in rows.chunks_exact_mut(size).enumerate() {
            basis.evaluate_into(demonstration.phase(k), &mut scratch, row, &mut slopes);
        }
        let mut design = Self {
            size,
            svd: Svd::of(samples, size, &rows)?,
            rows,
            constant: vec![0.0; size],
            left: Vec::new(),
        };
        let mut constant = vec![0.0; size];
        design.solve(&vec![1.0; samples], &mut constant);
        design.left = design
            .rows
            .chunks_exact(size)
            .map(|psi| 1.0 - dot(psi, &constant))
            .collect();
        design.constant = constant;
        Ok(design)
    }

    /// Shortest least-squares weights of `Ψ w = x`.
    fn solve(&self, x: &[f64], w: &mut [f64]) {
        let svd = &self.svd;
        let stride = svd.singular.len();
        let mut along = vec![0.0; stride];
        for (row, x) in svd.left.chunks_exact(stride).zip(x) {
            for (a, u) in along.iter_mut().zip(row) {
                *a += u * x;
            }
        }
        w.fill(0.0);
        for (j, along) in along.iter().enumerate().take(svd.rank(NEGLIGIBLE)) {
            let along = along / svd.singular[j];
            for (w, v) in w.iter_mut().zip(svd.right.chunks_exact(stride)) {
                *w += v[j] * along;
            }
        }
    }

    fn group(&self) -> GroupFit {
        let stride = self.svd.singular.len();
        // diag(singular) rightᵀ, filled up with zero rows.
        let mut compact = vec![0.0; self.size * self.size];
        for (j, s) in self.svd.singular.iter().enumerate() {
            for i in 0..self.size {
                compact[j * self.size + i] = s * self.svd.right[i * stride + j];
            }
        }
        GroupFit {
            compact,
            constant: self.constant.clone(),
            constant_residual: dot(&self.left, &self.left) / self.left.len() as f64,
        }
    }
}
