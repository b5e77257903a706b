//! A trained model.

use super::group::Group;
use super::layout::WeightLayout;
use super::prior::{PhaseVelocity, Prior};
use super::tuning::Tuning;
use crate::error::{BipError, length};
use hwall_numeric::check;
use hwall_numeric::dense::{Matrix, dot};

/// A trained model: `x_d(phase) = offset_d + Ψ(phase)ᵀ (mean_d + U_d c)` with `c ~ N(0, 1)`.
///
/// `Ψ` is an orthonormal basis of the span of the named one. The number of entries of `c` is the number of independent differences of the
/// demonstrations: at most one less than there are demonstrations. Weights have no process noise, so filtering `c` instead of all weights loses
/// nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    parts: ModelParts,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ModelParts {
    pub layout: WeightLayout,
    /// Offset subtracted from each degree of freedom.
    pub offset: Vec<f64>,
    /// Mean of the weights.
    pub mean: Vec<f64>,
    /// `U`, weights × rank.
    pub factor: Matrix,
    /// Variances of the residuals of the fits, by degree of freedom.
    pub noise_fit: Vec<f64>,
    pub noise_held_out: Option<Vec<f64>>,
    pub phase_velocity: PhaseVelocity,
    pub sampling_period: f64,
    pub demonstrations: usize,
    /// Shrinkage of the prior's covariance by older versions; 0 in models trained now.
    pub shrinkage: f64,
    pub tuning: Option<Tuning>,
}

impl Model {
    pub(crate) fn from_parts(parts: ModelParts) -> Self {
        Self { parts }
    }

    pub(crate) fn parts(&self) -> &ModelParts {
        &self.parts
    }

    /// From a prior computed elsewhere.
    ///
    /// # Errors
    /// Lengths that do not fit the groups, numbers that are not finite, variances that are not
    /// positive.
    pub fn from_prior(prior: &Prior) -> Result<Self, BipError> {
        let layout = WeightLayout::new(&prior.groups)?;
        prior.validate()?;
        let mut mean = Vec::with_capacity(layout.weights());
        let mut factor = Matrix::zeros(layout.weights(), prior.rank);
        let mut from = 0;
        for dof in 0..layout.dofs() {
            let basis = layout.basis(dof);
            let named = from..from + basis.basis().count();
            mean.extend(basis.orthonormal_weights(&prior.mean[named.clone()]));
            for c in 0..prior.rank {
                let column: Vec<f64> = named
                    .clone()
                    .map(|w| prior.factor[w * prior.rank + c])
                    .collect();
                for (w, x) in layout.range(dof).zip(basis.orthonormal_weights(&column)) {
                    factor[(w, c)] = x;
                }
            }
            from = named.end;
        }
        check::all_finite("mean", &mean)?;
        check::all_finite("factor", factor.entries())?;
        Ok(Self::from_parts(ModelParts {
            layout,
            offset: prior.offset.clone(),
            mean,
            factor,
            noise_fit: prior.noise.clone(),
            noise_held_out: None,
            phase_velocity: prior.phase_velocity,
            sampling_period: prior.sampling_period,
            demonstrations: prior.rank + 1,
            shrinkage: 0.0,
            tuning: None,
        }))
    }

    /// The prior in the weights of the named bases, with the noise of the fit. It does not contain held-out noise and tuning.
    #[must_use]
    pub fn to_prior(&self) -> Prior {
        let ModelParts { layout, factor, .. } = &self.parts;
        let rank = factor.columns();
        let (mut mean, mut named) = (Vec::new(), Vec::new());
        for dof in 0..layout.dofs() {
            let basis = layout.basis(dof);
            mean.extend(basis.named_weights(&self.parts.mean[layout.range(dof)]));
            let first = named.len();
            named.resize(first + basis.basis().count() * rank, 0.0);
            for c in 0..rank {
                let column: Vec<f64> = layout.range(dof).map(|w| factor[(w, c)]).collect();
                for (b, w) in basis.named_weights(&column).into_iter().enumerate() {
                    named[first + b * rank + c] = w;
                }
            }
        }
        Prior {
            groups: layout.groups().to_vec(),
            mean,
            factor: named,
            rank,
            offset: self.parts.offset.clone(),
            noise: self.parts.noise_fit.clone(),
            phase_velocity: self.parts.phase_velocity,
            sampling_period: self.parts.sampling_period,
        }
    }

    /// The same model with these filter parameters.
    ///
    /// # Errors
    /// A factor that is not positive, a variance or time that is negative.
    pub fn with_tuning(mut self, tuning: Tuning) -> Result<Self, BipError> {
        tuning.validate()?;
        self.parts.tuning = Some(tuning);
        Ok(self)
    }

    /// Groups, in the order of their degrees of freedom.
    #[must_use]
    pub fn groups(&self) -> &[Group] {
        self.parts.layout.groups()
    }

    /// Degrees of freedom of all groups.
    #[must_use]
    pub fn dofs(&self) -> usize {
        self.parts.layout.dofs()
    }

    /// Number of independent directions in which the demonstrations differ, and therefore the motions of the prior. The state of a filter has two
    /// more variables.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.parts.factor.columns()
    }

    /// Demonstrations the model was trained on.
    #[must_use]
    pub fn demonstrations(&self) -> usize {
        self.parts.demonstrations
    }

    /// Variance of the measurement noise of each degree of freedom from the residual of the fit: mean over the demonstrations of their mean squared
    /// residuals.
    #[must_use]
    pub fn noise_fit(&self) -> &[f64] {
        &self.parts.noise_fit
    }

    /// Variance of the measurement noise from held-out demonstrations: deviations of unseen motions that the model cannot express. `None` if not
    /// requested or if there was only one demonstration.
    #[must_use]
    pub fn noise_held_out(&self) -> Option<&[f64]> {
        self.parts.noise_held_out.as_deref()
    }

    /// Mean and variance of the phase velocity.
    #[must_use]
    pub fn phase_velocity(&self) -> PhaseVelocity {
        self.parts.phase_velocity
    }

    /// Mean time between two samples of the demonstrations.
    #[must_use]
    pub fn sampling_period(&self) -> f64 {
        self.parts.sampling_period
    }

    /// The result of [`tune`](crate::judge::tune); `None` if the model was not tuned.
    #[must_use]
    pub fn tuning(&self) -> Option<Tuning> {
        self.parts.tuning
    }

    /// Offset subtracted from each degree of freedom before the fit; zero without centring.
    #[must_use]
    pub fn offset(&self) -> &[f64] {
        &self.parts.offset
    }

    /// Mean trajectory at a phase, before any observation; `mean` has one entry per degree of freedom. Allocates.
    ///
    /// # Errors
    /// A phase that is not finite or so far out that a polynomial overflows, another length.
    pub fn mean_at(&self, phase: f64, mean: &mut [f64]) -> Result<(), BipError> {
        let ModelParts { layout, offset, .. } = &self.parts;
        check::finite("phase", phase)?;
        length("mean", self.dofs(), mean.len())?;
        let values: Vec<Vec<f64>> = layout
            .bases()
            .iter()
            .map(|b| {
                let (mut v, mut d) = (vec![0.0; b.size()], vec![0.0; b.size()]);
                b.evaluate_into(phase, &mut vec![0.0; b.scratch_len()], &mut v, &mut d);
                v
            })
            .collect();
        for (dof, (m, offset)) in mean.iter_mut().zip(offset).enumerate() {
            let weights = &self.parts.mean[layout.range(dof)];
            *m = offset + dot(&values[layout.group(dof)], weights);
        }
        check::all_finite("mean", mean).map_err(|_| BipError::Overflow { phase })
    }
}
