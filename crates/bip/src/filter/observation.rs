//! Evidence: the measured degrees of freedom, their values and noise.

use crate::error::{BipError, length};
use hwall_numeric::check;
use hwall_numeric::dense::cholesky_in_place;

/// Values of some degrees of freedom. Degrees of freedom that are not listed are not observed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation<'a> {
    pub(crate) dofs: &'a [usize],
    pub(crate) values: &'a [f64],
    pub(crate) noise: Noise<'a>,
}

/// Noise of an observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Noise<'a> {
    Model,
    Variances(&'a [f64]),
    Covariance(&'a [f64]),
}

impl<'a> Observation<'a> {
    /// Uses the measurement noise of the filter.
    #[must_use]
    pub fn new(dofs: &'a [usize], values: &'a [f64]) -> Self {
        Self {
            dofs,
            values,
            noise: Noise::Model,
        }
    }

    /// The observed degrees of freedom, for filters of other crates.
    #[must_use]
    pub const fn dofs(&self) -> &'a [usize] {
        self.dofs
    }

    /// Their values.
    #[must_use]
    pub const fn values(&self) -> &'a [f64] {
        self.values
    }

    /// Uses a variance for each value instead, in the squared unit of the degree of freedom.
    #[must_use]
    pub fn with_variances(self, variances: &'a [f64]) -> Self {
        Self {
            noise: Noise::Variances(variances),
            ..self
        }
    }

    /// Uses a covariance of all values instead, row-major. Only its lower triangle is read.
    #[must_use]
    pub fn with_covariance(self, covariance: &'a [f64]) -> Self {
        Self {
            noise: Noise::Covariance(covariance),
            ..self
        }
    }

    /// Checks everything but the covariance; `seen` is scratch with one entry per degree of freedom.
    pub(crate) fn validate(&self, seen: &mut [bool]) -> Result<(), BipError> {
        length("values", self.dofs.len(), self.values.len())?;
        check::all_finite("values", self.values)?;
        seen.fill(false);
        for &dof in self.dofs {
            if dof >= seen.len() {
                return Err(BipError::UnknownDof {
                    dof,
                    dofs: seen.len(),
                });
            }
            if std::mem::replace(&mut seen[dof], true) {
                return Err(BipError::DuplicateDof { dof });
            }
        }
        match self.noise {
            Noise::Model => Ok(()),
            Noise::Variances(v) => {
                length("variances", self.dofs.len(), v.len())?;
                for v in v {
                    check::positive("variance", *v)?;
                }
                Ok(())
            }
            Noise::Covariance(c) => {
                length("covariance", self.dofs.len().pow(2), c.len())?;
                Ok(check::all_finite("covariance", c)?)
            }
        }
    }

    /// Writes the Cholesky factor of the noise of some of the rows, if it is a full covariance.
    pub(crate) fn factor_noise(
        &self,
        kept: impl ExactSizeIterator<Item = usize> + Clone,
        lower: &mut [f64],
    ) -> Result<(), BipError> {
        if let Noise::Covariance(c) = self.noise {
            let m = kept.len();
            let lower = &mut lower[..m * m];
            for (i, row) in kept.clone().enumerate() {
                for (j, column) in kept.clone().enumerate() {
                    lower[i * m + j] = c[row * self.dofs.len() + column];
                }
            }
            cholesky_in_place(m, lower).map_err(BipError::indefinite("covariance"))?;
        }
        Ok(())
    }
}

/// Statistics of an observation, relative to the estimate before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Update {
    /// Values accepted.
    pub rows: usize,
    /// Values rejected as outliers.
    pub gated: usize,
    /// Squared Mahalanobis distance of the observation from its prediction; its mean is `rows` if the model is right.
    pub distance_squared: f64,
    /// Natural log density of the observation; a rejected value counts as if it were at the gate.
    pub log_likelihood: f64,
}

impl Update {
    /// An empty observation.
    pub(crate) const NOTHING: Self = Self {
        rows: 0,
        gated: 0,
        distance_squared: 0.0,
        log_likelihood: 0.0,
    };
}
