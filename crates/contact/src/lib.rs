#![doc = include_str!("../README.md")]

mod baseline;
mod baseline_minimum_jerk;
mod baseline_neighbour;
mod baseline_ridge;
mod deterministic;
mod error;
mod estimate;
mod fused;
mod gates;
mod gaussian;
mod gaze_evidence;
mod held_out_errors;
mod learned;
mod learning;
mod local_ridge;
#[cfg(feature = "serde")]
mod model_file;
mod predict;
mod primitive;
mod reach_set;
mod reach_track;
mod standing;
mod steady;
mod stream;
mod surface_share;
mod touch_path;

pub use baseline::{ConstantVelocity, Hold};
pub use baseline_minimum_jerk::MinimumJerk;
pub use baseline_neighbour::NearestNeighbour;
pub use baseline_ridge::RidgeWindow;
pub use deterministic::{DeterministicPredictor, PredictorConfig};
pub use error::ContactError;
pub use estimate::{ContactEstimate, ContactEstimator, TimeToContact};
pub use fused::{FusedConfig, FusedPredictor};
pub use gaze_evidence::GazeModel;
pub use glam;
pub use hwall_bip;
pub use hwall_hand;
pub use hwall_numeric::ArgumentError;
pub use hwall_scene;
pub use learned::{Combination, LearnedConfig, LearnedEstimator, LearnedModel};
pub use predict::{ContactPrediction, PredictionSource, Predictor, PredictorInput};
pub use steady::SteadyPoint;
pub use stream::StreamEstimator;
