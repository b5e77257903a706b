//! One recorded motion, validated on construction.

use crate::error::{BipError, length};
use hwall_numeric::check;

/// A motion from start to end: time stamps, and one value per sample and degree of freedom.
///
/// The caller chooses the unit of time: seconds for a real recording, samples (`period = 1`) to compare with the published implementation. Filters
/// of the model use the same unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Demonstration {
    times: Vec<f64>,
    dofs: usize,
    values: Vec<f64>,
}

impl Demonstration {
    /// Evenly sampled: `values` are row-major, with `dofs` numbers per sample; samples are `period` apart.
    ///
    /// # Errors
    /// Fewer than two samples, a value that is not finite, a length that is not a multiple of
    /// `dofs`, a period that is not positive.
    pub fn from_samples(period: f64, dofs: usize, values: Vec<f64>) -> Result<Self, BipError> {
        check::positive("sampling period", period)?;
        let samples = values.len() / dofs.max(1);
        let times = (0..samples).map(|k| k as f64 * period).collect();
        Self::from_timestamps(times, dofs, values)
    }

    /// With a time stamp for every sample: any start, any spacing, strictly increasing.
    ///
    /// # Errors
    /// As [`from_samples`](Self::from_samples); a time stamp that repeats or goes back.
    pub fn from_timestamps(
        times: Vec<f64>,
        dofs: usize,
        values: Vec<f64>,
    ) -> Result<Self, BipError> {
        check::that(dofs > 0, "degrees of freedom", dofs as f64, "at least 1")?;
        length("values", times.len().saturating_mul(dofs), values.len())?;
        if times.len() < 2 {
            return Err(BipError::TooShort {
                samples: times.len(),
            });
        }
        check::all_finite("times", &times)?;
        if let Some(k) = (1..times.len()).find(|&k| times[k] <= times[k - 1]) {
            return Err(BipError::TimeNotIncreasing {
                row: k,
                time: times[k],
                previous: times[k - 1],
            });
        }
        check::finite("duration", times[times.len() - 1] - times[0])?;
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            return Err(BipError::NonFiniteSample {
                row: at / dofs,
                column: at % dofs,
                value: values[at],
            });
        }
        Ok(Self {
            times,
            dofs,
            values,
        })
    }

    /// Number of samples, at least two.
    #[must_use]
    #[allow(clippy::len_without_is_empty)] // never empty
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Degrees of freedom.
    #[must_use]
    pub fn dofs(&self) -> usize {
        self.dofs
    }

    /// Values of one sample.
    ///
    /// # Panics
    /// If there is no such sample.
    #[must_use]
    pub fn sample(&self, k: usize) -> &[f64] {
        &self.values[k * self.dofs..(k + 1) * self.dofs]
    }

    /// Time stamps.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Time from the first to the last time stamp; positive.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.times[self.times.len() - 1] - self.times[0]
    }

    /// Elapsed share of the duration at a sample: 0 at the first, 1 at the last.
    ///
    /// # Panics
    /// If there is no such sample.
    #[must_use]
    pub fn phase(&self, k: usize) -> f64 {
        (self.times[k] - self.times[0]) / self.duration()
    }
}
