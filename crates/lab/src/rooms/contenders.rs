//! The predictors that are compared: ray casts, estimates moved to a surface, fusions and their ablations.

use crate::contact::candidates::{self, BoxedEstimator, Role};
use crate::end_to_end;
use anyhow::Context;
use hwall_contact::{
    ContactPrediction, DeterministicConfig, DeterministicPredictor, FusedConfig, FusedPredictor,
    LearnedConfig, LearnedModel, Predictor, PredictorInput, StreamEstimator,
};
use hwall_hand::{Gaze, LabelledReach, WatchConfig};
use hwall_scene::Scene;
use hwall_stage::training::{self, Stream};

/// The dissertation's predictor, which leads are gained over.
pub const RAY_CAST: &str = "ray cast";
/// The ray cast of which the point is where the gaze meets the surface, until the hand is near.
pub const RAY_LED: &str = "ray cast, ray led";
/// The main contender.
pub const FUSED: &str = "learned, fused";
/// The same without a gaze.
pub const NO_GAZE: &str = "learned, fused without gaze";
/// The response of an arm that is learnt end to end.
pub const END_TO_END: &str = "end-to-end, middle of the board";

/// A predictor and its name in the tables.
pub struct Contender {
    /// For tables and legends.
    pub name: String,
    /// What it is.
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

    /// The ray cast that follows the gaze until the hand is near.
    ///
    /// # Errors
    /// Limits that the predictor refuses.
    pub fn ray_led() -> anyhow::Result<Self> {
        let config = DeterministicConfig::ray_led();
        Ok(Self::of(RAY_LED, DeterministicPredictor::new(config)?))
    }

    /// An estimator alone: its estimate moved to the closest surface.
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

/// What is learnt once from the training people and shared by the contenders.
pub struct SharedTraining {
    /// What was learnt from.
    pub reaches: Vec<LabelledReach>,
    learned: LearnedModel,
    /// The default settings with the gaze of these people.
    pub config: FusedConfig,
}

impl SharedTraining {
    /// Learns the main estimator, how people look, and how far fused predictions are off.
    ///
    /// # Errors
    /// Too few reaches, or too few looks.
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
            // These people are simulated, and so is the tracker.
            registration_sd_m: 0.0,
            ..FusedConfig::default()
        };
        let held_out = (&reaches[..], &held_out[..]);
        let regions = training::region_model(scene, streams, held_out, &config);
        config.regions = Some(regions.context("the regions")?);
        Ok(Self {
            learned,
            config,
            reaches,
        })
    }

    /// The main contender with these settings.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn fused(&self, config: &FusedConfig) -> anyhow::Result<Contender> {
        Contender::fused(FUSED, Box::new(self.learned.estimator()), config)
    }

    /// The contenders that are run under every condition.
    ///
    /// # Errors
    /// An estimator that cannot be trained.
    pub fn main(&self) -> anyhow::Result<Vec<Contender>> {
        let learned = || Box::new(self.learned.estimator());
        let mut without_gaze = self.fused(&self.config)?;
        without_gaze.name = NO_GAZE.to_owned();
        without_gaze.predictor = Box::new(WithoutGaze(without_gaze.predictor));
        Ok(vec![
            Contender::ray_cast()?,
            Contender::ray_led()?,
            Contender::projected("learned", learned())?,
            self.fused(&self.config)?,
            without_gaze,
        ])
    }

    /// All contenders: the ray casts, each baseline on the closest surface and fused, the rest of the main ones,
    /// and the response that leads an arm by joints.
    ///
    /// # Errors
    /// An estimator that cannot be trained.
    pub fn all(&self) -> anyhow::Result<Vec<Contender>> {
        let mut all = self.main()?;
        let mut baselines = Vec::new();
        let reaches: Vec<&LabelledReach> = self.reaches.iter().collect();
        for candidate in candidates::all(LearnedConfig::default()) {
            if candidate.role == Role::Baseline {
                let name = &candidate.name;
                let train = || (candidate.train)(&reaches).with_context(|| name.clone());
                baselines.push(Contender::projected(name, train()?)?);
                let fused = format!("{name}, fused");
                baselines.push(Contender::fused(fused, train()?, &self.config)?);
            }
        }
        all.splice(2..2, baselines);
        let response = end_to_end::candidate::predictor(&self.reaches);
        all.push(Contender::of(END_TO_END, response.context(END_TO_END)?));
        Ok(all)
    }
}

/// An estimate moved to the closest surface: shows what an estimator is worth without fusion.
struct Projected {
    stream: StreamEstimator<BoxedEstimator>,
    prediction: Option<ContactPrediction>,
}

/// Estimates further than this from every surface give no prediction, m.
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

/// A predictor that is shown no gaze.
struct WithoutGaze(Box<dyn Predictor + Send>);

impl Predictor for WithoutGaze {
    fn predict(&mut self, scene: &Scene, seen: &PredictorInput<'_>) -> &[ContactPrediction] {
        let mut frame = *seen.frame;
        frame.gaze = None;
        let seen = PredictorInput {
            frame: &frame,
            hand: seen.hand,
            gaze: Gaze::Lost,
        };
        self.0.predict(scene, &seen)
    }
}
