//! Where and when a reach ends, learnt from reaches: a regression beside an interaction primitive.

mod account;
mod adaptation;
mod blend;
mod blend_training;
mod config;
mod estimator;
mod gates;
mod local_ridge;
mod model;
#[cfg(feature = "serde")]
mod model_file;
mod places;
mod primitive;
mod quantiles;
mod reach_track;
mod samples;
mod sources;
mod training;
#[cfg(feature = "serde")]
mod tree_file;
mod trees;

pub use account::{Account, InputUse, StageAccount};
pub use config::{Combination, Frame, LearnedConfig};
pub use estimator::LearnedEstimator;
pub use model::LearnedModel;
