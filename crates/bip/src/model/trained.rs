//! What training leaves behind: everything a filter needs.

use crate::dense::dot;
use crate::error::{finite, length, not_negative, positive};
use crate::orthonormal::OrthonormalBasis;
use crate::{Basis, BipError};

/// What the degrees of freedom of a group are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Measured while filtering, such as a hand.
    Observed,
    /// Inferred while filtering, such as the arm that answers the hand.
    Controlled,
    /// Measured in some frames, inferred in others.
    Either,
}

/// Neighbouring degrees of freedom that share a basis and a role.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Name for reports.
    pub name: String,
    /// Number of degrees of freedom; groups follow each other in their order.
    pub dofs: usize,
    /// Basis of every one of them.
    pub basis: Basis,
    /// What they are for.
    pub role: Role,
}

impl Group {
    /// A group that is measured while filtering.
    #[must_use]
    pub fn observed(name: &str, dofs: usize, basis: Basis) -> Self {
        Self {
            name: name.to_owned(),
            dofs,
            basis,
            role: Role::Observed,
        }
    }

    /// A group that is inferred while filtering.
    #[must_use]
    pub fn controlled(name: &str, dofs: usize, basis: Basis) -> Self {
        Self {
            role: Role::Controlled,
            ..Self::observed(name, dofs, basis)
        }
    }
}

/// Mean and variance of the phase velocity, share of the motion per unit of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseVelocity {
    /// Mean, 1/time.
    pub mean: f64,
    /// Variance, 1/time².
    pub variance: f64,
}

/// Parameters of a filter that were chosen on held-out demonstrations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuning {
    /// Factor on the variance of the held-out noise.
    pub noise_factor: f64,
    /// Variance of the random acceleration of the phase, 1/time⁴.
    pub acceleration_variance: f64,
    /// Factor on the standard deviations of predictions with which 90 % intervals held 90 % of the
    /// ends of held-out motions. Part of `predict_at`, not of moments.
    pub spread: f64,
    /// Time over which deviations last; 0: independent from sample to sample.
    pub correlation_time: f64,
}

/// A prior that was computed elsewhere, in the weights of the named bases.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// Groups in the order of their degrees of freedom.
    pub groups: Vec<Group>,
    /// Mean weights, all of degree of freedom 0 first.
    pub mean: Vec<f64>,
    /// Factor `U` of the covariance `U Uᵀ`: weights × rank, row-major.
    pub factor: Vec<f64>,
    /// Columns of the factor; may be 0.
    pub rank: usize,
    /// What is added to the functions' sum in each degree of freedom.
    pub offset: Vec<f64>,
    /// Variance of the measurement noise of each degree of freedom; positive.
    pub noise: Vec<f64>,
    /// Phase velocity.
    pub phase_velocity: PhaseVelocity,
    /// Usual time between two samples; scales the default process noise.
    pub sampling_period: f64,
}

/// Where the basis and the weights of one degree of freedom lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DofLayout {
    pub(crate) group: usize,
    pub(crate) first_weight: usize,
}

/// A trained model: `x_d(phase) = offset_d + Ψ(phase)ᵀ (mean_d + U_d c)` with `c ~ N(0, 1)`.
///
/// `Ψ` is an orthonormal basis of the span of the named one. `c` has as many entries as the
/// demonstrations have independent differences: one less than there are demonstrations, or fewer.
/// Weights have no process noise, so filtering `c` instead of all weights loses nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    pub(crate) groups: Vec<Group>,
    pub(crate) bases: Vec<OrthonormalBasis>,
    pub(crate) layout: Vec<DofLayout>,
    pub(crate) offset: Vec<f64>,
    pub(crate) mean: Vec<f64>,
    pub(crate) factor: Vec<f64>,
    pub(crate) rank: usize,
    pub(crate) noise_fit: Vec<f64>,
    pub(crate) noise_held_out: Option<Vec<f64>>,
    pub(crate) phase_velocity: PhaseVelocity,
    pub(crate) sampling_period: f64,
    pub(crate) demonstrations: usize,
    pub(crate) shrinkage: f64,
    pub(crate) tuning: Option<Tuning>,
}

/// Bases of the groups and the place of every degree of freedom among the weights.
pub(crate) fn lay_out(
    groups: &[Group],
) -> Result<(Vec<OrthonormalBasis>, Vec<DofLayout>, usize), BipError> {
    let bases: Vec<_> = groups
        .iter()
        .map(|g| OrthonormalBasis::new(g.basis))
        .collect::<Result<_, _>>()?;
    let (layout, weights) = lay_out_with(groups, &bases)?;
    Ok((bases, layout, weights))
}

/// The same for bases that are known.
pub(crate) fn lay_out_with(
    groups: &[Group],
    bases: &[OrthonormalBasis],
) -> Result<(Vec<DofLayout>, usize), BipError> {
    let mut layout = Vec::new();
    let mut weights = 0;
    for (group, (g, basis)) in groups.iter().zip(bases).enumerate() {
        for _ in 0..g.dofs {
            layout.push(DofLayout {
                group,
                first_weight: weights,
            });
            weights += basis.size();
        }
    }
    if layout.is_empty() {
        return Err(BipError::Parameter {
            what: "degrees of freedom",
            value: 0.0,
            wanted: "at least 1",
        });
    }
    Ok((layout, weights))
}

impl Model {
    /// From a prior that was computed elsewhere.
    ///
    /// # Errors
    /// Lengths that do not fit the groups, numbers that are not finite, variances that are not
    /// positive.
    pub fn from_prior(prior: &Prior) -> Result<Self, BipError> {
        let (bases, layout, weights) = lay_out(&prior.groups)?;
        let named: usize = prior.groups.iter().map(|g| g.dofs * g.basis.count()).sum();
        length("mean", named, prior.mean.len())?;
        let entries = named.saturating_mul(prior.rank);
        length("factor", entries, prior.factor.len())?;
        length("noise", layout.len(), prior.noise.len())?;
        length("offset", layout.len(), prior.offset.len())?;
        finite("offset", &prior.offset)?;
        finite("mean", &prior.mean)?;
        finite("factor", &prior.factor)?;
        for v in &prior.noise {
            positive("measurement noise", *v)?;
        }
        finite("mean phase velocity", &[prior.phase_velocity.mean])?;
        positive(
            "variance of the phase velocity",
            prior.phase_velocity.variance,
        )?;
        positive("sampling period", prior.sampling_period)?;
        let mut mean = Vec::with_capacity(weights);
        let mut factor = vec![0.0; weights * prior.rank];
        let mut from = 0;
        for dof in &layout {
            let basis = &bases[dof.group];
            let count = basis.basis().count();
            mean.extend(basis.orthonormal_weights(&prior.mean[from..from + count]));
            for c in 0..prior.rank {
                let column: Vec<f64> = (from..from + count)
                    .map(|w| prior.factor[w * prior.rank + c])
                    .collect();
                for (j, w) in basis.orthonormal_weights(&column).into_iter().enumerate() {
                    factor[(dof.first_weight + j) * prior.rank + c] = w;
                }
            }
            from += count;
        }
        finite("mean", &mean)?;
        finite("factor", &factor)?;
        Ok(Self {
            groups: prior.groups.clone(),
            offset: prior.offset.clone(),
            bases,
            layout,
            mean,
            factor,
            rank: prior.rank,
            noise_fit: prior.noise.clone(),
            noise_held_out: None,
            phase_velocity: prior.phase_velocity,
            sampling_period: prior.sampling_period,
            demonstrations: prior.rank + 1,
            shrinkage: 0.0,
            tuning: None,
        })
    }

    /// Groups, in the order of their degrees of freedom.
    #[must_use]
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// Degrees of freedom of all groups.
    #[must_use]
    pub fn dofs(&self) -> usize {
        self.layout.len()
    }

    /// Independent directions in which motions of the prior differ; the state of a filter has two
    /// more. Without shrinkage those in which the demonstrations differ.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Demonstrations the model was trained on.
    #[must_use]
    pub fn demonstrations(&self) -> usize {
        self.demonstrations
    }

    /// The `α` of the covariance, see [`Shrinkage`](crate::Shrinkage): as given, or as chosen.
    #[must_use]
    pub fn shrinkage(&self) -> f64 {
        self.shrinkage
    }

    /// Condition number of the named basis of a group over the motion (257 phases or more).
    /// Weights of the named basis lose its logarithm in digits; filtering does not.
    ///
    /// # Panics
    /// If there is no such group.
    #[must_use]
    pub fn condition_number(&self, group: usize) -> f64 {
        self.bases[group].condition()
    }

    /// Variance of the measurement noise per degree of freedom, as the residual of the fit has it:
    /// mean over the demonstrations of their mean squared residuals.
    #[must_use]
    pub fn noise_fit(&self) -> &[f64] {
        &self.noise_fit
    }

    /// The same from demonstrations that were held out: what the model cannot express of a motion
    /// it was not trained on. `None` where it was not asked for or there was one demonstration only.
    #[must_use]
    pub fn noise_held_out(&self) -> Option<&[f64]> {
        self.noise_held_out.as_deref()
    }

    /// Mean and variance of the phase velocity.
    #[must_use]
    pub fn phase_velocity(&self) -> PhaseVelocity {
        self.phase_velocity
    }

    /// Mean time between two samples of the demonstrations.
    #[must_use]
    pub fn sampling_period(&self) -> f64 {
        self.sampling_period
    }

    /// What [`tune`](crate::tune) found; `None` if it was not asked.
    #[must_use]
    pub fn tuning(&self) -> Option<Tuning> {
        self.tuning
    }

    /// The same model with these parameters for its filters.
    ///
    /// # Errors
    /// A factor that is not positive, a variance that is negative.
    pub fn with_tuning(mut self, tuning: Tuning) -> Result<Self, BipError> {
        positive("noise factor", tuning.noise_factor)?;
        not_negative("acceleration variance", tuning.acceleration_variance)?;
        positive("spread", tuning.spread)?;
        not_negative("correlation time", tuning.correlation_time)?;
        self.tuning = Some(tuning);
        Ok(self)
    }

    /// Mean trajectory at a phase, before anything is observed; `mean` has one entry a degree of
    /// freedom. Allocates.
    ///
    /// # Errors
    /// A phase that is not finite or so far out that a polynomial overflows, another length.
    pub fn mean_at(&self, phase: f64, mean: &mut [f64]) -> Result<(), BipError> {
        finite("phase", &[phase])?;
        length("mean", self.dofs(), mean.len())?;
        let values: Vec<Vec<f64>> = self
            .bases
            .iter()
            .map(|b| {
                let (mut v, mut d) = (vec![0.0; b.size()], vec![0.0; b.size()]);
                b.evaluate_into(phase, &mut vec![0.0; 2 * b.basis().count()], &mut v, &mut d);
                v
            })
            .collect();
        for ((m, dof), offset) in mean.iter_mut().zip(&self.layout).zip(&self.offset) {
            let psi = &values[dof.group];
            *m = offset + dot(psi, &self.mean[dof.first_weight..][..psi.len()]);
        }
        finite("mean", mean).map_err(|_| BipError::Overflow { phase })
    }

    /// The prior in the weights of the named bases, with the noise of the fit. Held-out noise and
    /// tuning have no place in it.
    #[must_use]
    pub fn to_prior(&self) -> Prior {
        let mut mean = Vec::new();
        let mut factor = Vec::new();
        for dof in &self.layout {
            let basis = &self.bases[dof.group];
            let weights = dof.first_weight..dof.first_weight + basis.size();
            mean.extend(basis.named_weights(&self.mean[weights.clone()]));
            let first_row = factor.len();
            factor.resize(first_row + basis.basis().count() * self.rank, 0.0);
            for c in 0..self.rank {
                let column: Vec<f64> = weights
                    .clone()
                    .map(|w| self.factor[w * self.rank + c])
                    .collect();
                for (b, w) in basis.named_weights(&column).into_iter().enumerate() {
                    factor[first_row + b * self.rank + c] = w;
                }
            }
        }
        Prior {
            groups: self.groups.clone(),
            mean,
            factor,
            rank: self.rank,
            offset: self.offset.clone(),
            noise: self.noise_fit.clone(),
            phase_velocity: self.phase_velocity,
            sampling_period: self.sampling_period,
        }
    }

    /// What was subtracted from each degree of freedom before the fit; zero without centring.
    #[must_use]
    pub fn offset(&self) -> &[f64] {
        &self.offset
    }
}
