//! Parameters of a filter.

use hwall_numeric::{ArgumentError, check};

/// The initial measurement noise of a filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoiseSource {
    /// Residual of the fit: the published convention. Too small for an unseen person.
    Fit,
    /// Residual of held-out demonstrations.
    HeldOut,
    /// Held-out noise if the model has it, otherwise the noise of the fit.
    Best,
}

/// Criterion for outliers.
///
/// Each value is tested separately against its own prediction and variance, so that one lost finger does not discard the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    /// Largest distance of a value from its prediction, in standard deviations of the innovation. Default 5: one good value in two million is
    /// rejected.
    pub deviations: f64,
    /// After this many consecutive observations with more than half of the values rejected, the next one is accepted as a whole, because then the
    /// estimate must be wrong. Default 5.
    pub patience: usize,
}

impl Default for Gate {
    fn default() -> Self {
        Self {
            deviations: 5.0,
            patience: 5,
        }
    }
}

/// Parameters of a filter. Time has the unit of the demonstrations.
#[derive(Debug, Clone, PartialEq)]
pub struct FilterConfig {
    /// Phase at the start. Default 0.
    pub phase: f64,
    /// Variance of the phase at the start. Default 1e-4: one hundredth of the motion.
    pub phase_variance: f64,
    /// Variance of the random acceleration of the phase, 1/time⁴, constant within a step: a step of length dt adds `[dt⁴/4, dt³/2; dt³/2, dt²]`
    /// times it. Default `None`: as [tuned](crate::judge::tune); otherwise such that the phase velocity changes by one hundredth of its mean per
    /// sampling period.
    pub acceleration_variance: Option<f64>,
    /// Measurement noise. Default [`NoiseSource::Best`].
    pub noise: NoiseSource,
    /// Factor on the variance of the measurement noise. A person deviates from the demonstrations in the same direction for many samples;
    /// independent noise must be larger to compensate. Default `None`: as [tuned](crate::judge::tune) (for held-out noise), otherwise 1.
    pub noise_factor: Option<f64>,
    /// Rejection of outliers. Default `None`: every value is accepted.
    pub gate: Option<Gate>,
    /// Correlation time of deviations from the model: a first-order Markov process with the variance of the noise, plus independent noise with the
    /// variance of the fit. Default `None`: as [tuned](crate::judge::tune), otherwise 0, i.e. independent from sample to sample. Observations with
    /// their own noise count as independent.
    pub correlation_time: Option<f64>,
    /// Keep the mean of the phase within `[0, 1]`. Default `true`.
    pub clip_phase: bool,
}

impl Default for FilterConfig {
    fn default() -> Self {
        Self {
            phase: 0.0,
            phase_variance: 1e-4,
            acceleration_variance: None,
            noise: NoiseSource::Best,
            noise_factor: None,
            gate: None,
            correlation_time: None,
            clip_phase: true,
        }
    }
}

impl FilterConfig {
    /// Rejects a start and a gate outside their ranges.
    pub(crate) fn validate(&self) -> Result<(), ArgumentError> {
        check::finite("phase", self.phase)?;
        check::positive("phase variance", self.phase_variance)?;
        if let Some(gate) = self.gate {
            check::positive("deviations of the gate", gate.deviations)?;
        }
        Ok(())
    }
}
