//! Adds and removes demonstrations one at a time.

use super::config::{PhaseRate, TrainingConfig};
use super::demonstration::Demonstration;
use super::fit::{Centred, Fit};
use super::held_out::HeldOut;
use super::weight_distribution::WeightDistribution;
use crate::error::BipError;
use crate::model::{Model, ModelParts, PhaseVelocity, WeightLayout};
use hwall_numeric::check;

/// Number of a demonstration in its trainer; numbers are never reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DemonstrationId(u64);

/// A set of demonstrations that can grow and shrink, and its model.
///
/// Adding fits only the new demonstration; the other fits are kept. The model does not depend on the history of the set: adding some and removing
/// them again gives the same model, bit by bit. Another order of additions changes only the rounding and, with more demonstrations than
/// [`TrainingConfig::held_out`], which of them are held out.
///
/// ```
/// use hwall_bip::{Basis, Demonstration, Group, Trainer, TrainingConfig};
/// let reach = |depth_m: f64| {
///     let values = (0..50).map(|k| depth_m * (k as f64 / 49.0).powi(2)).collect();
///     Demonstration::from_samples(0.02, 1, values)
/// };
/// let hand = Group::observed("hand", 1, Basis::Legendre { count: 5 });
/// let mut trainer = Trainer::new(TrainingConfig::new(vec![hand]))?;
/// trainer.add(&reach(0.4)?)?;
/// let bad = trainer.add(&reach(-3.0)?)?;
/// trainer.add(&reach(0.5)?)?;
/// trainer.remove(bad)?;
/// assert_eq!(trainer.model()?.demonstrations(), 2);
/// # Ok::<(), hwall_bip::BipError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Trainer {
    config: TrainingConfig,
    layout: WeightLayout,
    /// In order of their numbers.
    fits: Vec<(DemonstrationId, Fit)>,
    next: u64,
}

/// Quality of the fit of one demonstration.
pub(crate) struct FitQuality {
    pub samples: usize,
    /// Functions of the first group that the samples resolve.
    pub functions: usize,
    /// Mean squared residual of each degree of freedom.
    pub residual: Vec<f64>,
}

impl Trainer {
    /// A trainer without demonstrations.
    ///
    /// # Errors
    /// Bad parameters, no degree of freedom.
    pub fn new(config: TrainingConfig) -> Result<Self, BipError> {
        config.validate()?;
        Ok(Self {
            layout: WeightLayout::new(&config.groups)?,
            config,
            fits: Vec::new(),
            next: 0,
        })
    }

    /// Adds a demonstration of any length and sampling rate.
    ///
    /// Least squares on its phase (by singular values; the minimum-norm solution with fewer samples than functions), after cutting the rest before
    /// and after the motion if [`TrainingConfig::onset`] is set.
    ///
    /// # Errors
    /// A number of degrees of freedom that differs from the groups; with an onset, nothing moves. The set is then unchanged.
    pub fn add(&mut self, demonstration: &Demonstration) -> Result<DemonstrationId, BipError> {
        if demonstration.dofs() != self.layout.dofs() {
            return Err(BipError::DofMismatch {
                demonstration: self.len(),
                expected: self.layout.dofs(),
                got: demonstration.dofs(),
            });
        }
        let fit = match &self.config.onset {
            None => Fit::of(demonstration, &self.layout)?,
            Some(onset) => Fit::of(&demonstration.trimmed(onset)?, &self.layout)?,
        };
        let id = DemonstrationId(self.next);
        self.next += 1;
        self.fits.push((id, fit));
        Ok(id)
    }

    /// Removes a demonstration.
    ///
    /// # Errors
    /// The trainer does not contain this demonstration, or no longer contains it.
    pub fn remove(&mut self, id: DemonstrationId) -> Result<(), BipError> {
        match self.fits.binary_search_by_key(&id, |(id, _)| *id) {
            Ok(at) => {
                self.fits.remove(at);
                Ok(())
            }
            Err(_) => Err(BipError::UnknownDemonstration { id: id.0 }),
        }
    }

    /// Number of demonstrations.
    #[must_use]
    pub fn len(&self) -> usize {
        self.fits.len()
    }

    /// Are there no demonstrations?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.fits.is_empty()
    }

    /// Model of the present demonstrations.
    ///
    /// Mean and covariance (with `demonstrations - 1`) of the weights, the covariance as a factor
    /// whose rank is at most `demonstrations - 1`. One demonstration gives rank 0: only the phase
    /// is filtered.
    ///
    /// # Errors
    /// No demonstration; values so large that their squares overflow; singular values that do not
    /// converge.
    pub fn model(&self) -> Result<Model, BipError> {
        let n = self.fits.len();
        if n == 0 {
            return Err(BipError::TooFewDemonstrations { needed: 1, got: 0 });
        }
        let offset = self.offset();
        let fits = self.centred(&offset);
        let fits: Vec<&Centred<'_>> = fits.iter().collect();
        let noise_fit: Vec<f64> = (0..self.layout.dofs())
            .map(|d| {
                let mean = fits.iter().map(|f| f.residual[d]).sum::<f64>() / n as f64;
                mean.max(self.noise_floor(d))
            })
            .collect();
        let distribution = WeightDistribution::of(&fits, &self.layout)?;
        let held_out = HeldOut {
            layout: &self.layout,
            fits: &fits,
            distribution: &distribution,
            noise_fit: &noise_fit,
        };
        let count = if n < 2 {
            0
        } else {
            self.config.held_out.min(n)
        };
        let noise_held_out = match count {
            0 => None,
            _ => Some(held_out.noise(count, self.config.max_rank)?),
        };
        let mut prior = distribution;
        prior.truncate(self.config.max_rank.unwrap_or(usize::MAX));
        check::all_finite("mean weights", &prior.mean)?;
        check::all_finite("covariance factor", prior.factor.entries())?;
        check::all_finite("measurement noise", &noise_fit)?;
        let phase_velocity = self.phase_velocity();
        check::positive("mean phase velocity", phase_velocity.mean)?;
        check::positive("variance of the phase velocity", phase_velocity.variance)?;
        check::all_finite("held-out noise", noise_held_out.as_deref().unwrap_or(&[]))?;
        Ok(Model::from_parts(ModelParts {
            layout: self.layout.clone(),
            offset,
            mean: prior.mean,
            factor: prior.factor,
            noise_fit,
            noise_held_out,
            phase_velocity,
            sampling_period: self.fits.iter().map(|(_, f)| f.period()).sum::<f64>() / n as f64,
            demonstrations: n,
            shrinkage: 0.0,
            tuning: None,
        }))
    }

    /// Mean over held-out demonstrations of their log density under the prior of the others, with the held-out noise of the full model; `None` if
    /// it has none.
    pub(crate) fn held_out_density(&self, model: &Model) -> Result<Option<f64>, BipError> {
        let Some(noise) = model.noise_held_out() else {
            return Ok(None);
        };
        let fits = self.centred(model.offset());
        let fits: Vec<&Centred<'_>> = fits.iter().collect();
        let held_out = HeldOut {
            layout: &self.layout,
            fits: &fits,
            distribution: &WeightDistribution::of(&fits, &self.layout)?,
            noise_fit: model.noise_fit(),
        };
        let count = self.config.held_out.min(self.len());
        Ok(Some(held_out.log_density(count, noise) / count as f64))
    }

    /// One model per group of demonstrations, with the mean of the group and the common covariance around the group means. Everything else comes
    /// from the model of all demonstrations.
    pub(crate) fn models_of_groups(
        &self,
        labels: &[usize],
        groups: usize,
    ) -> Result<Vec<Model>, BipError> {
        let all = self.model()?;
        let fits = self.centred(all.offset());
        let fits: Vec<&Centred<'_>> = fits.iter().collect();
        WeightDistribution::within_groups(&fits, labels, groups, &self.layout)?
            .into_iter()
            .map(|mut prior| {
                prior.truncate(self.config.max_rank.unwrap_or(usize::MAX));
                check::all_finite("mean weights", &prior.mean)?;
                check::all_finite("covariance factor", prior.factor.entries())?;
                Ok(Model::from_parts(ModelParts {
                    mean: prior.mean,
                    factor: prior.factor,
                    ..all.parts().clone()
                }))
            })
            .collect()
    }

    /// Quality of the fits of the values minus the offset of a model with one group.
    pub(crate) fn fit_qualities(&self, model: &Model) -> Vec<FitQuality> {
        self.centred(model.offset())
            .into_iter()
            .map(|f| FitQuality {
                samples: f.fit.samples,
                functions: f.fit.groups[0].rank(),
                residual: f.residual,
            })
            .collect()
    }

    /// The fits of the values minus an offset.
    fn centred(&self, offset: &[f64]) -> Vec<Centred<'_>> {
        self.fits
            .iter()
            .map(|(_, fit)| fit.less(offset, &self.layout))
            .collect()
    }

    /// Mean over all samples, or zero without centring.
    fn offset(&self) -> Vec<f64> {
        let samples: usize = self.fits.iter().map(|(_, f)| f.samples).sum();
        (0..self.layout.dofs())
            .map(|d| {
                if !self.config.centre {
                    return 0.0;
                }
                self.fits
                    .iter()
                    .map(|(_, f)| f.columns[d].mean * (f.samples as f64 / samples as f64))
                    .sum()
            })
            .collect()
    }

    /// Lowest variance of the noise of a degree of freedom.
    pub(crate) fn noise_floor(&self, d: usize) -> f64 {
        let (low, high) = self
            .fits
            .iter()
            .map(|(_, f)| &f.columns[d])
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| {
                (low.min(c.low), high.max(c.high))
            });
        let range = high - low;
        let size = low.abs().max(high.abs());
        // A constant column has the range of its rounding; an all-zero column has no magnitude either.
        let scale = if range > 1e-9 * size {
            range
        } else if size > 0.0 {
            size
        } else {
            1.0
        };
        (self.config.noise_floor * scale)
            .powi(2)
            .max(f64::MIN_POSITIVE.sqrt())
    }

    fn phase_velocity(&self) -> PhaseVelocity {
        let n = self.fits.len();
        let rates: Vec<f64> = self
            .fits
            .iter()
            .map(|(_, f)| match self.config.rate {
                PhaseRate::PerDuration => 1.0 / f.duration,
                PhaseRate::PerSample => 1.0 / (f.samples as f64 * f.period()),
            })
            .collect();
        let mean = rates.iter().sum::<f64>() / n as f64;
        let squares: f64 = rates.iter().map(|r| (r - mean).powi(2)).sum();
        let divisor = match self.config.rate {
            PhaseRate::PerDuration => (n - 1).max(1),
            PhaseRate::PerSample => n,
        };
        PhaseVelocity {
            mean,
            variance: (squares / divisor as f64).max((self.config.velocity_floor * mean).powi(2)),
        }
    }
}

impl Model {
    /// Trains on demonstrations of any lengths and sampling rates: a [`Trainer`] with all of them added.
    ///
    /// # Errors
    /// As [`Trainer::add`] and [`Trainer::model`].
    pub fn train(
        demonstrations: &[Demonstration],
        config: &TrainingConfig,
    ) -> Result<Self, BipError> {
        let mut trainer = Trainer::new(config.clone())?;
        for demonstration in demonstrations {
            trainer.add(demonstration)?;
        }
        trainer.model()
    }
}
