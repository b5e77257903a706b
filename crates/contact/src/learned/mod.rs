//! Where and when a reach ends, learnt from reaches: regressions, trees and an interaction primitive, weighed by
//! their errors on reaches that were held out.

mod account;
mod alone;
mod blend;
mod config;
mod estimator;
#[cfg(feature = "serde")]
mod file;
mod held_out;
mod model;
mod primitive;
mod reaches;
mod regression;

pub use account::{Account, InputUse, StageAccount};
pub use config::{Combination, Frame, LearnedConfig};
pub use estimator::LearnedEstimator;
pub use held_out::{HeldOutEstimator, HeldOutReach};
pub use model::LearnedModel;
