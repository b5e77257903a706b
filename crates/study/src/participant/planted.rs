//! Planted answers of simulated participants in the dissertation's studies.

use super::simulated::ParticipantConfig;
use crate::protocol::{Protocol, ReadyProtocol};

/// Mean answers to the three questions of the dissertation's experiment 2, of eight people, 1 to 5.
pub const EXPERIMENT_2_MEANS: [f64; 3] = [4.25, 4.125, 4.375];

/// The simulated participants for a protocol: in experiment 2 with the published mean ratings, otherwise the default ones.
///
/// In experiment 1 they find both walls equally real, because the published shares are unknown.
#[must_use]
pub fn planted_for(protocol: &Protocol) -> ParticipantConfig {
    let mut nominal = ParticipantConfig::default();
    if ReadyProtocol::of(protocol) == Some(ReadyProtocol::Experiment2) {
        nominal.ratings = EXPERIMENT_2_MEANS.to_vec();
    }
    nominal
}
