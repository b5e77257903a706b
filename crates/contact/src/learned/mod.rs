//! Where and when a reach ends, learnt from reaches: regressions, trees and an interaction primitive, weighed by
//! their errors on reaches that were held out.

mod account;
mod alone;
mod blend;
mod config;
mod estimator;
mod held_out;
#[cfg(feature = "serde")]
mod input_file;
mod model;
#[cfg(feature = "serde")]
mod model_file;
mod paces;
mod primitive;
mod primitive_training;
mod reach_track;
mod regression;
mod samples;
#[cfg(feature = "serde")]
mod tree_file;

pub use account::{Account, InputUse, StageAccount};
pub use config::{Combination, Frame, LearnedConfig};
pub use estimator::LearnedEstimator;
pub use held_out::{HeldOutEstimator, HeldOutReach};
pub use model::LearnedModel;
