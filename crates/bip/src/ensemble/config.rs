//! Parameters of an ensemble filter.

use crate::filter::FilterConfig;

/// How the members of an ensemble are updated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EnsembleUpdate {
    /// Each member sees the observation with its own noise, drawn with the standard deviation of the measurement. Source: [Burgers 1998]; as
    /// described in [Campbell 2019].
    Perturbed,
    /// No noise is drawn: mean and deviations of the members are moved so that their mean and covariance are exactly those of the linear update.
    /// Source: the square root of [Andrews 1968] as in [Whitaker 2002], eq. 10, for all rows at once.
    Deterministic,
}

/// Parameters of an ensemble filter.
#[derive(Debug, Clone, PartialEq)]
pub struct EnsembleConfig {
    /// Number of members, at least 2. Default 300. With fewer members than state variables, directions without variation count as certain.
    pub members: usize,
    /// Seed of the random numbers. Default 0.
    pub seed: u64,
    /// Default [`EnsembleUpdate::Deterministic`].
    pub update: EnsembleUpdate,
    /// Start, process noise and measurement noise, as for [`Filter`](crate::filter::Filter).
    pub filter: FilterConfig,
}

impl Default for EnsembleConfig {
    fn default() -> Self {
        Self {
            members: 300,
            seed: 0,
            update: EnsembleUpdate::Deterministic,
            filter: FilterConfig::default(),
        }
    }
}
