//! How a model is made of demonstrations.

use crate::error::{not_negative, positive, share};
use crate::{BipError, Demonstration, Group, Model, Onset, Trainer};
use std::borrow::Cow;

/// Demonstrations held out unless told otherwise.
pub(crate) const HELD_OUT: usize = 64;

/// How a demonstration's length becomes a phase velocity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PhaseRate {
    /// `1 / duration`, variance with `demonstrations - 1`: consistent with the phase of the samples.
    PerDuration,
    /// `1 / (samples · mean period)`, variance with `demonstrations`: the published convention.
    PerSample,
}

/// Prior covariance of the weights between what the demonstrations show and what they cannot.
///
/// `(1 - α) S + α T` with `S` the covariance of the demonstrations and `T` the part of it within
/// each single degree of freedom. `S` allows no motion but mixtures of the demonstrations; `T`
/// lets every degree of freedom move by itself, as far as the demonstrations do. (Blocks of whole
/// groups would not do: with fewer demonstrations than weights of a group, its block forbids new
/// motions too.) With `α > 0` the rank grows from `demonstrations - 1` to the number of weights,
/// and the time of an update with its square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shrinkage {
    /// `α = 0`: exact for the demonstrations, and small.
    None,
    /// `α` as given, in `[0, 1]`.
    Fixed(f64),
    /// The `α` of a fixed grid, 0 included, under which demonstrations that were held out have the
    /// highest density at their own phases, each with the noise estimated for that `α`. 0 of one
    /// or two demonstrations.
    LeaveOneOut,
}

/// How a model is made of demonstrations.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainingConfig {
    /// Groups of degrees of freedom, in the order of the columns.
    pub groups: Vec<Group>,
    /// Subtract the mean over all samples before the fit. It matters only for bases that cannot
    /// express a constant (Gaussian, sigmoid); scaling changes nothing in any of them, because
    /// every degree of freedom is fitted by itself. Default `true`.
    pub centre: bool,
    /// Meaning of the phase velocity. Default [`PhaseRate::PerDuration`].
    pub rate: PhaseRate,
    /// Cut the rest before and after the motion from every demonstration. Default `None`: they
    /// were cut already.
    pub onset: Option<Onset>,
    /// Prior covariance between demonstrated and possible motions. Default [`Shrinkage::None`].
    pub shrinkage: Shrinkage,
    /// Keep no more directions than this, the strongest ones relative to the spread of each degree
    /// of freedom, after shrinkage. Default `None`: all, which is exact.
    pub max_rank: Option<usize>,
    /// Demonstrations to hold out one at a time for the measurement noise, spread evenly; 0 for
    /// none. All of up to 64 by default: beyond, time grows and the estimate hardly changes.
    pub held_out: usize,
    /// Lowest standard deviation of the measurement noise as a share of the range of the degree of
    /// freedom (of its size where it is constant). Default 1e-4; keeps a perfect fit from claiming
    /// a perfect sensor.
    pub noise_floor: f64,
    /// Lowest standard deviation of the phase velocity as a share of its mean. Default 0.05; it
    /// decides alone where there is one demonstration, or several equally long ones.
    pub velocity_floor: f64,
}

impl TrainingConfig {
    /// Defaults for these groups.
    #[must_use]
    pub fn new(groups: Vec<Group>) -> Self {
        Self {
            groups,
            centre: true,
            rate: PhaseRate::PerDuration,
            onset: None,
            shrinkage: Shrinkage::None,
            max_rank: None,
            held_out: HELD_OUT,
            noise_floor: 1e-4,
            velocity_floor: 0.05,
        }
    }

    /// The conventions of the published implementation, for comparison with it.
    #[must_use]
    pub fn published(groups: Vec<Group>) -> Self {
        Self {
            centre: false,
            rate: PhaseRate::PerSample,
            ..Self::new(groups)
        }
    }

    /// Rejects parameters outside their ranges; groups are checked where they are laid out.
    pub(crate) fn validate(&self) -> Result<(), BipError> {
        not_negative("noise floor", self.noise_floor)?;
        positive("velocity floor", self.velocity_floor)?;
        if let Shrinkage::Fixed(alpha) = self.shrinkage {
            share("shrinkage", alpha)?;
        }
        self.onset.as_ref().map_or(Ok(()), Onset::validate)
    }

    /// The demonstrations as training sees them, rest cut off, and the configuration that takes
    /// them as they are.
    pub(crate) fn trimmed<'a>(
        &self,
        demonstrations: &'a [Demonstration],
    ) -> Result<(Cow<'a, [Demonstration]>, Self), BipError> {
        let mut config = self.clone();
        Ok(match config.onset.take() {
            None => (Cow::Borrowed(demonstrations), config),
            Some(onset) => {
                let trimmed = demonstrations.iter().map(|d| d.trimmed(&onset));
                (Cow::Owned(trimmed.collect::<Result<_, _>>()?), config)
            }
        })
    }
}

impl Model {
    /// Trains on demonstrations of any lengths and sampling rates: a [`Trainer`] that is given all
    /// of them at once.
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
