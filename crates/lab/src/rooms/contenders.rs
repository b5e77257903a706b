//! The predictors that are compared: the dissertation's ray cast, and the fusion.

use anyhow::Context;
use hwall_contact::{
    DeterministicConfig, DeterministicPredictor, FusedConfig, FusedPredictor, LearnedConfig,
    LearnedEstimator, LearnedModel,
};
use hwall_scene::Scene;
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
    /// Learns the main estimator, the gaze model, and the errors of fused predictions.
    ///
    /// # Errors
    /// Too few reaches, or too few fixations.
    pub fn new(scene: &Scene, streams: &[Stream]) -> anyhow::Result<Self> {
        let reaches = training::reaches(streams)?;
        let config = LearnedConfig {
            gaze: true,
            ..LearnedConfig::default()
        };
        let learned = LearnedModel::train_and_hold_out(&reaches, &config);
        let (learned, held_out) = learned.context("the learned estimator")?;
        let evidence =
            training::evidence_model(streams, |_| learned.estimator()).context("the gaze")?;
        let mut config = FusedConfig {
            evidence,
            // People and tracker are simulated, so registration is exact.
            registration_sd_m: 0.0,
            ..FusedConfig::default()
        };
        let held_out = (&reaches[..], &held_out[..]);
        let regions = training::region_model(scene, streams, held_out, &config);
        config.regions = Some(regions.context("the regions")?);
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
