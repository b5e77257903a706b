//! A prior in the weights of the bases named by the user.

use super::group::Group;
use crate::error::{BipError, length};
use hwall_numeric::{ArgumentError, check};

/// Mean and variance of the phase velocity, in motions per unit of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseVelocity {
    /// Mean, 1/time.
    pub mean: f64,
    /// Variance, 1/time².
    pub variance: f64,
}

impl PhaseVelocity {
    /// Rejects a mean that is not finite and a variance that is not positive.
    pub(super) fn validate(&self) -> Result<(), ArgumentError> {
        // The duration is the inverse: zero or negative values are invalid.
        check::positive("mean phase velocity", self.mean)?;
        check::positive("variance of the phase velocity", self.variance)?;
        Ok(())
    }
}

/// A prior computed elsewhere, in the weights of the named bases.
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
    /// Offset added to the sum of the functions in each degree of freedom.
    pub offset: Vec<f64>,
    /// Variance of the measurement noise of each degree of freedom; positive.
    pub noise: Vec<f64>,
    /// Phase velocity.
    pub phase_velocity: PhaseVelocity,
    /// Typical time between two samples; scales the default process noise.
    pub sampling_period: f64,
}

impl Prior {
    /// Rejects lengths that do not fit the groups and numbers outside their ranges.
    pub(super) fn validate(&self) -> Result<(), BipError> {
        let dofs: usize = self.groups.iter().map(|g| g.dofs).sum();
        let weights: usize = self.groups.iter().map(|g| g.dofs * g.basis.count()).sum();
        length("mean", weights, self.mean.len())?;
        let entries = weights.saturating_mul(self.rank);
        length("factor", entries, self.factor.len())?;
        length("noise", dofs, self.noise.len())?;
        length("offset", dofs, self.offset.len())?;
        self.phase_velocity.validate()?;
        let shape = [&self.offset[..], &self.mean, &self.factor];
        Ok(check_numbers(shape, &self.noise, self.sampling_period)?)
    }
}

/// Offset, mean and factor are finite, noise and sampling period positive.
pub(super) fn check_numbers<'a>(
    [offset, mean, factor]: [&[f64]; 3],
    noise: impl IntoIterator<Item = &'a f64>,
    sampling_period: f64,
) -> Result<(), ArgumentError> {
    check::all_finite("offset", offset)?;
    check::all_finite("mean", mean)?;
    check::all_finite("factor", factor)?;
    for v in noise {
        check::positive("measurement noise", *v)?;
    }
    check::positive("sampling period", sampling_period)?;
    Ok(())
}
