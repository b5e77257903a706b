//! Where and when a reach ends, learnt from reaches: a regression beside an interaction primitive.

mod config;
mod estimator;
mod gates;
mod held_out_errors;
mod local_ridge;
mod model;
#[cfg(feature = "serde")]
mod model_file;
mod primitive;
mod reach_track;
mod samples;
mod training;

pub use config::{Combination, LearnedConfig};
pub use estimator::LearnedEstimator;
pub use model::LearnedModel;
