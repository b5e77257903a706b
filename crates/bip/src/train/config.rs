//! Training settings.

use super::demonstration::Demonstration;
use super::onset::Onset;
use crate::error::BipError;
use crate::model::Group;
use hwall_numeric::check;
use std::borrow::Cow;

/// Default number of held-out demonstrations.
pub(crate) const HELD_OUT: usize = 64;

/// Definition of the phase velocity of a demonstration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PhaseRate {
    /// `1 / duration`, variance with `demonstrations - 1`: consistent with the phase of the samples.
    PerDuration,
    /// `1 / (samples · mean period)`, variance with `demonstrations`: the published convention.
    PerSample,
}

/// Training settings.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainingConfig {
    /// Groups of degrees of freedom, in the order of the columns.
    pub groups: Vec<Group>,
    /// Subtract the mean over all samples before the fit. It matters only for bases that cannot express a constant (Gaussian, sigmoid). Scaling
    /// would have no effect, because each degree of freedom is fitted separately. Default `true`.
    pub centre: bool,
    /// Definition of the phase velocity. Default [`PhaseRate::PerDuration`].
    pub rate: PhaseRate,
    /// Cut the rest before and after the motion from every demonstration. Default `None`: the demonstrations contain no rest.
    pub onset: Option<Onset>,
    /// Largest number of directions kept, the strongest ones relative to the spread of each degree of freedom. Default `None`: all, which is exact.
    pub max_rank: Option<usize>,
    /// Number of demonstrations to hold out, one at a time, for the measurement noise, spread evenly; 0 for none. Default 64: more cost time and
    /// hardly change the estimate.
    pub held_out: usize,
    /// Lowest standard deviation of the measurement noise as a share of the range of the degree of freedom (of its magnitude if constant). Default
    /// 1e-4; without this floor a perfect fit would imply a perfect sensor.
    pub noise_floor: f64,
    /// Lowest standard deviation of the phase velocity as a share of its mean. Default 0.05; it applies with one demonstration, or several of the
    /// same length.
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

    /// Rejects parameters outside their ranges; groups are checked when they are laid out.
    pub(super) fn validate(&self) -> Result<(), BipError> {
        check::non_negative("noise floor", self.noise_floor)?;
        check::positive("velocity floor", self.velocity_floor)?;
        self.onset.as_ref().map_or(Ok(()), Onset::validate)
    }

    /// The demonstrations without their rest, and a configuration without onset.
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
