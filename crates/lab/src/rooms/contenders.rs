//! The predictors that are compared: the dissertation's ray cast, and the fusion.

use anyhow::Context;
use hwall_contact::{
    DeterministicConfig, DeterministicPredictor, FusedConfig, FusedPredictor, LearnedConfig,
    LearnedEstimator, LearnedModel,
};
use hwall_stage::training::{self, Stream};

/// The dissertation's predictor, the reference for gained leads.
///
/// # Errors
/// Limits that the predictor refuses.
pub fn ray_cast() -> anyhow::Result<DeterministicPredictor> {
    Ok(DeterministicPredictor::new(DeterministicConfig::default())?)
}

/// Models learnt once from the training people.
pub struct SharedTraining {
    learned: LearnedModel,
    /// The default settings with the learnt gaze model.
    pub config: FusedConfig,
}

impl SharedTraining {
    /// Learns the main estimator and the gaze model.
    ///
    /// # Errors
    /// Too few reaches, or too few fixations.
    pub fn new(streams: &[Stream]) -> anyhow::Result<Self> {
        let reaches = training::reaches(streams)?;
        let config = LearnedConfig {
            gaze: true,
            ..LearnedConfig::default()
        };
        let learned = LearnedModel::train(&reaches, &config).context("the learned estimator")?;
        let evidence =
            training::evidence_model(streams, |_| learned.estimator()).context("the gaze")?;
        let config = FusedConfig {
            evidence,
            // People and tracker are simulated, so registration is exact.
            registration_sd_m: 0.0,
            ..FusedConfig::default()
        };
        Ok(Self { learned, config })
    }

    /// The fusion with these settings.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn fused(&self, config: &FusedConfig) -> anyhow::Result<FusedPredictor<LearnedEstimator>> {
        Ok(FusedPredictor::new(
            self.learned.estimator(),
            config.clone(),
        )?)
    }
}
