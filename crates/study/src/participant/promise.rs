//! The power that a protocol promises for planted effects.

use super::simulated::ParticipantConfig;
use crate::error::StudyError;
use crate::present::Stimulus;
use crate::protocol::Protocol;
use hwall::psychophysics::{EffectPower, Factor, PowerStudy, PowerTest, power};

/// How often a study of this protocol finds each planted effect, by the analysis of variance of the logarithms of the answers
/// against own errors, at 5 %.
///
/// Left out of it: lapses, fatigue, differences between what was wanted and what was rendered, how strongly roughness varies for
/// each participant. So it is a little too high.
///
/// # Errors
/// A factor of one level alone; settings outside their range.
pub fn promised_power(
    protocol: &Protocol,
    participants: &ParticipantConfig,
    studies: usize,
) -> Result<Vec<EffectPower>, StudyError> {
    participants.validate()?;
    protocol.validate()?;
    let factors = protocol.factors.iter().filter(|f| f.levels.len() > 1);
    let within = factors.map(|f| Factor::new(&f.name, f.levels.iter().cloned()));
    let means = (0..protocol.conditions()).map(|condition| {
        let stimulus = Stimulus::of(protocol, condition)?;
        Ok(participants
            .roughness
            .ln(stimulus.angle_deg, stimulus.speed_mm_per_s))
    });
    Ok(power(&PowerStudy {
        within: within.collect(),
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
