//! From demonstrations to a model.

mod config;
mod demonstration;
mod fit;
mod held_out;
mod onset;
mod trainer;
mod weight_distribution;

pub(crate) use config::HELD_OUT;
pub use config::{PhaseRate, TrainingConfig};
pub use demonstration::Demonstration;
pub use onset::Onset;
pub use trainer::{DemonstrationId, Trainer};
