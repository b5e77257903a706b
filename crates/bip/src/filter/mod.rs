//! The exact filter: phase, phase velocity and the coefficients of one motion in progress.

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
