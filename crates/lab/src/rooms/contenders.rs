//! The predictors that are compared: ray casts, estimates moved to a surface, fusions.

use crate::contact::candidates::BoxedEstimator;
use anyhow::Context;
use hwall_contact::{
    ContactPrediction, DeterministicConfig, DeterministicPredictor, FusedConfig, FusedPredictor,
    LearnedConfig, LearnedModel, Predictor, PredictorInput, StreamEstimator,
};
use hwall_hand::WatchConfig;
use hwall_scene::Scene;
use hwall_stage::training::{self, Stream};

/// The dissertation's predictor, the reference for gained leads.
pub const RAY_CAST: &str = "ray cast";
/// The main contender.
pub const FUSED: &str = "learned, fused";

/// A predictor and its name in the tables.
pub struct Contender {
    /// For tables and legends.
    pub name: String,
    /// The predictor.
    pub predictor: Box<dyn Predictor + Send>,
}

impl Contender {
    fn of(name: impl Into<String>, predictor: impl Predictor + Send + 'static) -> Self {
        Self {
            name: name.into(),
            predictor: Box::new(predictor),
        }
    }

    /// The dissertation's ray cast.
    ///
    /// # Errors
    /// Limits that the predictor refuses.
    pub fn ray_cast() -> anyhow::Result<Self> {
        let config = DeterministicConfig::default();
        Ok(Self::of(RAY_CAST, DeterministicPredictor::new(config)?))
    }

    /// The ray cast led by the gaze until the hand is near.
    ///
    /// # Errors
    /// Limits that the predictor refuses.
    pub fn ray_led() -> anyhow::Result<Self> {
        let config = DeterministicConfig::ray_led();
        Ok(Self::of(
            "ray cast, ray led",
            DeterministicPredictor::new(config)?,
        ))
    }

    /// An estimator alone, with its estimate projected to the closest surface.
    ///
    /// # Errors
    /// Settings that the watch refuses.
    pub fn projected(name: &str, estimator: BoxedEstimator) -> anyhow::Result<Self> {
        let projected = Projected {
            stream: StreamEstimator::new(estimator, WatchConfig::default())?,
            prediction: None,
        };
        Ok(Self::of(format!("{name}, closest surface"), projected))
    }

    /// An estimator fused with gaze and scene.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn fused(
        name: impl Into<String>,
        estimator: BoxedEstimator,
        config: &FusedConfig,
    ) -> anyhow::Result<Self> {
        let config = config.clone();
        Ok(Self::of(name, FusedPredictor::new(estimator, config)?))
    }
}

/// Models learnt once from the training people and shared by the contenders.
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

    /// The main contender with these settings.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn fused(&self, config: &FusedConfig) -> anyhow::Result<Contender> {
        Contender::fused(FUSED, Box::new(self.learned.estimator()), config)
    }
}

/// An estimate projected to the closest surface: an estimator's performance without fusion.
struct Projected {
    stream: StreamEstimator<BoxedEstimator>,
    prediction: Option<ContactPrediction>,
}

/// Largest distance of an estimate from a surface for a prediction, m.
const FARTHEST_M: f64 = 1.0;

impl Predictor for Projected {
    fn predict(&mut self, scene: &Scene, seen: &PredictorInput<'_>) -> &[ContactPrediction] {
        let estimate = self.stream.step(seen.frame, seen.hand);
        self.prediction = estimate.and_then(|e| {
            let closest = scene.closest_touchable(e.point_m, FARTHEST_M).ok()??;
            let at = (closest.surface, closest.point_m, closest.normal);
            Some(ContactPrediction {
                covariance_m2: e.covariance_m2,
                distance_m: closest.distance_m,
                time_to_contact_s: e.time_to_contact_s,
                ..ContactPrediction::of_place(at.0, at.1, at.2)
            })
        });
        self.prediction.as_slice()
    }
}
