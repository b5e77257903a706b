//! Simulated participants: felt roughness and answers.

mod promise;
mod roughness;
mod simulated;

pub use promise::promised_power;
pub use roughness::Roughness;
pub use simulated::{ParticipantConfig, SimulatedParticipant};
