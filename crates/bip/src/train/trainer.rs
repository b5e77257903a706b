//! Demonstrations added and removed one at a time.

use crate::error::{finite, positive};
use crate::fit::{Centred, Fit};
use crate::held_out::HeldOut;
use crate::model::{DofLayout, lay_out};
use crate::orthonormal::OrthonormalBasis;
use crate::spread::Spread;
use crate::training::HELD_OUT;
use crate::{BipError, Demonstration, Model, PhaseRate, PhaseVelocity, Shrinkage, TrainingConfig};

/// Names a demonstration within the trainer that it was added to; never given twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DemonstrationId(u64);

/// A set of demonstrations that grows and shrinks, and the model of those it holds.
///
/// Adding fits the new demonstration only; the least squares of the others stay. The model does
/// not depend on how the set came about: adding some and removing them again gives the model of
/// the rest, bit by bit. Another order of additions changes rounding only, and with more
/// demonstrations than [`TrainingConfig::held_out`], which of them are held out.
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
    bases: Vec<OrthonormalBasis>,
    layout: Vec<DofLayout>,
    weights: usize,
    /// In the order of their numbers.
    fits: Vec<(DemonstrationId, Fit)>,
    next: u64,
}

impl Trainer {
    /// Holds no demonstration yet.
    ///
    /// # Errors
    /// Bad parameters, no degree of freedom.
    pub fn new(config: TrainingConfig) -> Result<Self, BipError> {
        config.validate()?;
        let (bases, layout, weights) = lay_out(&config.groups)?;
        Ok(Self {
            config,
            bases,
            layout,
            weights,
            fits: Vec::new(),
            next: 0,
        })
    }

    /// Takes a demonstration of any length and sampling rate.
    ///
    /// Least squares on its phase (singular values; the shortest solution where it has fewer
    /// samples than functions), after its rest before and after was cut if
    /// [`TrainingConfig::onset`] asks for it.
    ///
    /// # Errors
    /// Another number of degrees of freedom than the groups have; with an onset, nothing that
    /// moves. The set is then as it was.
    pub fn add(&mut self, demonstration: &Demonstration) -> Result<DemonstrationId, BipError> {
        if demonstration.dofs() != self.layout.len() {
            return Err(BipError::DofMismatch {
                demonstration: self.len(),
                expected: self.layout.len(),
                got: demonstration.dofs(),
            });
        }
        let fit = |d: &Demonstration| Fit::of(d, &self.bases, &self.layout, self.weights);
        let fit = match &self.config.onset {
            None => fit(demonstration)?,
            Some(onset) => fit(&demonstration.trimmed(onset)?)?,
        };
        let id = DemonstrationId(self.next);
        self.next += 1;
        self.fits.push((id, fit));
        Ok(id)
    }

    /// Forgets a demonstration.
    ///
    /// # Errors
    /// One that the trainer does not hold, or no longer.
    pub fn remove(&mut self, id: DemonstrationId) -> Result<(), BipError> {
        match self.fits.binary_search_by_key(&id, |(id, _)| *id) {
            Ok(at) => {
                self.fits.remove(at);
                Ok(())
            }
            Err(_) => Err(BipError::UnknownDemonstration { id: id.0 }),
        }
    }

    /// Demonstrations it holds.
    #[must_use]
    pub fn len(&self) -> usize {
        self.fits.len()
    }

    /// Does it hold none?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.fits.is_empty()
    }

    /// Model of the demonstrations it holds.
    ///
    /// Mean and covariance (with `demonstrations - 1`) of the weights, the covariance as a factor
    /// whose rank is at most `demonstrations - 1`, or with shrinkage the number of weights. One
    /// demonstration gives rank 0: only the phase is filtered.
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
        let noise_fit: Vec<f64> = (0..self.layout.len())
            .map(|d| {
                let mean = fits.iter().map(|f| f.residual[d]).sum::<f64>() / n as f64;
                mean.max(self.noise_floor(d))
            })
            .collect();
        let spread = Spread::of(&fits, &self.layout, &self.bases)?;
        let held_out = HeldOut {
            groups: &self.config.groups,
            bases: &self.bases,
            layout: &self.layout,
            fits: &fits,
            spread: &spread,
            noise_fit: &noise_fit,
        };
        let count = if n < 2 {
            0
        } else {
            self.config.held_out.min(n)
        };
        let shrinkage = match self.config.shrinkage {
            Shrinkage::None => 0.0,
            Shrinkage::Fixed(alpha) => alpha,
            // Chosen whether or not the held-out noise is wanted.
            Shrinkage::LeaveOneOut if n > 1 && count == 0 => {
                held_out.best_alpha(HELD_OUT.min(n))?
            }
            Shrinkage::LeaveOneOut => held_out.best_alpha(count)?,
        };
        let noise_held_out = match count {
            0 => None,
            _ => Some(held_out.noise(count, shrinkage, self.config.max_rank)?),
        };
        let mut prior = spread.shrunk(shrinkage, &self.layout, &self.bases)?;
        prior.truncate(self.config.max_rank.unwrap_or(usize::MAX));
        finite("mean weights", &prior.mean)?;
        finite("covariance factor", &prior.factor)?;
        finite("measurement noise", &noise_fit)?;
        let phase_velocity = self.phase_velocity();
        positive("mean phase velocity", phase_velocity.mean)?;
        positive("variance of the phase velocity", phase_velocity.variance)?;
        finite("held-out noise", noise_held_out.as_deref().unwrap_or(&[]))?;
        Ok(Model {
            groups: self.config.groups.clone(),
            bases: self.bases.clone(),
            layout: self.layout.clone(),
            offset,
            mean: prior.mean,
            factor: prior.factor,
            rank: prior.rank,
            noise_fit,
            noise_held_out,
            phase_velocity,
            sampling_period: self.fits.iter().map(|(_, f)| f.period()).sum::<f64>() / n as f64,
            demonstrations: n,
            shrinkage,
            tuning: None,
        })
    }

    /// Mean over held-out demonstrations of the logarithm of their density under the prior of the
    /// others, with the held-out noise of the model of all; `None` if it has none.
    pub(crate) fn held_out_density(&self, model: &Model) -> Result<Option<f64>, BipError> {
        let Some(noise) = model.noise_held_out() else {
            return Ok(None);
        };
        let fits = self.centred(&model.offset);
        let fits: Vec<&Centred<'_>> = fits.iter().collect();
        let held_out = HeldOut {
            groups: &self.config.groups,
            bases: &self.bases,
            layout: &self.layout,
            fits: &fits,
            spread: &Spread::of(&fits, &self.layout, &self.bases)?,
            noise_fit: model.noise_fit(),
        };
        let count = self.config.held_out.min(self.len());
        let sum = held_out.log_density(count, model.shrinkage(), noise)?;
        Ok(Some(sum / count as f64))
    }

    /// One model a group of demonstrations: their own mean, and the covariance around the means of
    /// the groups, which all share. Everything else is that of the model of all.
    pub(crate) fn models_of_groups(
        &self,
        labels: &[usize],
        groups: usize,
    ) -> Result<Vec<Model>, BipError> {
        let all = self.model()?;
        let fits = self.centred(&all.offset);
        let fits: Vec<&Centred<'_>> = fits.iter().collect();
        Spread::within_groups(&fits, labels, groups, &self.layout, &self.bases)?
            .into_iter()
            .map(|mut prior| {
                prior.truncate(self.config.max_rank.unwrap_or(usize::MAX));
                finite("mean weights", &prior.mean)?;
                finite("covariance factor", &prior.factor)?;
                Ok(Model {
                    mean: prior.mean,
                    factor: prior.factor,
                    rank: prior.rank,
                    ..all.clone()
                })
            })
            .collect()
    }

    /// The fits of the values less an offset.
    pub(crate) fn centred(&self, offset: &[f64]) -> Vec<Centred<'_>> {
        self.fits
            .iter()
            .map(|(_, fit)| fit.less(offset, &self.layout))
            .collect()
    }

    /// Mean over all samples, or zero without centring.
    fn offset(&self) -> Vec<f64> {
        let samples: usize = self.fits.iter().map(|(_, f)| f.samples).sum();
        (0..self.layout.len())
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

    /// Variance below which the noise of a degree of freedom is not taken.
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
        // A constant column has the range of its rounding; an all-zero one has no size either.
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
