//! The exact filter: phase, phase velocity and the coefficients of one motion in progress.
//!
//! # How it works
//!
//! - N demonstrations differ in at most N - 1 directions, and weights have no process noise. So the filter uses phase, phase velocity and N - 1
//!   coefficients instead of all weights. This is exact.
//! - The posterior is the triangular square root of an information matrix, updated by reflections: symmetric and positive definite after any number
//!   of updates. The prediction step changes two rows, because only the phase has noise.
//! - Internally, each basis is replaced by an orthonormal one of the same span, so ill-conditioned choices do not cost accuracy.
//! - Evidence may concern the present (`observe`), any other phase (`observe_at`) or the phase itself (`observe_phase`), with the noise of the
//!   model, your own variances or a full covariance.
//! - Persistent deviations (`correlation_time`) are a Markov process in addition to the motion. They need no further state: a share of the last
//!   measurement is subtracted from each new one, so that the rows depend on two phases. On recorded hands this halves the error once 90 % of a
//!   reach is observed; a step takes one and a half times as long.
//! - An `EnsembleFilter` consists of members drawn from the prior and linearises nothing. It has two kinds of update: perturbed observations, and a
//!   deterministic square root, the default. With perturbed observations it can diverge if there are no more members than state variables.
//! - Model files are JSON with a version and a digest; they restore every bit, on any machine, because the change to orthonormal functions is
//!   stored instead of recomputed.
//! - AIC and BIC count all parameters and estimate the noise. The published forms count too few and fix the noise, so that, on data in metres, they
//!   select the edge of the grid.

mod config;
mod health;
mod last_measurements;
mod low_rank;
mod moments;
mod noise;
mod observation;
mod posterior;
mod projector;
mod update;

pub use config::{FilterConfig, Gate, NoiseSource};
pub use health::Health;
pub use low_rank::Filter;
pub use moments::TimeToEnd;
pub(crate) use noise::NoiseModel;
pub(crate) use observation::Noise;
pub use observation::{Observation, Update};
pub(crate) use posterior::{PHASE_STATES, PhaseDynamics, PhaseEstimate, Posterior};
