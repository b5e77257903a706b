//! Predicted power of a protocol for planted effects.

use super::simulated::ParticipantConfig;
use crate::error::StudyError;
use crate::present::{Patch, Stimulus};
use crate::protocol::Protocol;
use hwall::psychophysics::{EffectPower, PowerStudy, PowerTest, power};

/// Predicted power for each planted effect: analysis of variance of the logarithms of the answers in strata, at 5 %.
///
/// Ignores lapses, fatigue, differences between wanted and rendered stimuli, and differences in sensitivity between
/// participants. It is therefore slightly too high.
///
/// # Errors
/// A factor with only one level; settings outside their range; a condition for which roughness is not predicted.
pub fn promised_power(
    protocol: &Protocol,
    participants: &ParticipantConfig,
    studies: usize,
) -> Result<Vec<EffectPower>, StudyError> {
    participants.validate()?;
    protocol.validate()?;
    let factors = protocol.factors.iter().filter(|f| f.levels.len() > 1);
    let means = (0..protocol.conditions()).map(|condition| {
        let stimulus = Stimulus::of(protocol, condition)?;
        let unfelt = || StudyError::BadLevel {
            factor: "patch".to_owned(),
            level: stimulus.patch.map_or("none", Patch::word).to_owned(),
            wanted: "a patch of which the model feels something at every angle and speed of the study",
        };
        participants.roughness.wanted(&stimulus).ok_or_else(unfelt)
    });
    Ok(power(&PowerStudy {
        within: factors.cloned().collect(),
        means: means.collect::<Result<_, StudyError>>()?,
        subjects: protocol.subjects,
        between_sd: participants.modulus_sd,
        level_sd: 0.0,
        within_sd: participants.noise_sd.max(1e-6) / (protocol.repeats as f64).sqrt(),
        test: PowerTest::default(),
        alpha: 0.05,
        studies,
        seed: protocol.seed,
    })?)
}
