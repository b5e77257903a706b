//! The ensemble filter: a set of possible motions instead of a mean and a covariance.

mod config;
mod filter;
mod predictor;
mod table;
mod update;

pub use config::{EnsembleConfig, EnsembleUpdate};
pub use filter::EnsembleFilter;
