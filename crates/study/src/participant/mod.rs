//! Simulated participants: what they feel, and what they say.

mod roughness;
mod simulated;

pub use roughness::Roughness;
pub use simulated::{ParticipantConfig, SimulatedParticipant};
