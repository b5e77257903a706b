//! Which surface is about to be touched, where and when: by one ray, or by all evidence.

mod deterministic;
mod fused;
mod gaussian;
mod gaze_model;
mod prediction;
mod resting;
mod steady_point;
mod stream;
mod surface_shares;

pub use deterministic::{DeterministicConfig, DeterministicPredictor, RayLead};
pub use fused::{FusedConfig, FusedPredictor};
pub use gaze_model::GazeModel;
pub use prediction::{ContactPrediction, PredictionSource, Predictor, PredictorInput};
pub use steady_point::SteadyPoint;
pub use stream::StreamEstimator;
