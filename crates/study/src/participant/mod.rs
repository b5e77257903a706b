//! Simulated participants: what they feel, and what they say.

mod promise;
mod roughness;
mod simulated;

pub use promise::promised_power;
pub use roughness::Roughness;
pub use simulated::{ParticipantConfig, SimulatedParticipant};
