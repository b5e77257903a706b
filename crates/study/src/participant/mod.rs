//! Simulated participants: perceived roughness and answers.

mod planted;
mod promise;
mod roughness;
mod simulated;

pub use planted::{EXPERIMENT_2_MEANS, planted_for};
pub use promise::promised_power;
pub use roughness::Roughness;
pub use simulated::{ParticipantConfig, SimulatedParticipant};
