//! Which surface is about to be touched, where and when: by one ray, or by all evidence.

mod deterministic;
mod face_moments;
mod free_side;
mod fused;
mod fused_config;
mod gaussian;
mod gaze_memory;
mod gaze_model;
mod gaze_training;
mod gaze_weights;
mod hand_place;
mod look_shares;
mod prediction;
mod resting;
mod resting_hand;
mod steady_point;
mod stream;
mod surface_shares;

pub use deterministic::{DeterministicConfig, DeterministicPredictor, RayLead};
pub use fused::{Experience, FusedPredictor, TargetLook};
pub use fused_config::FusedConfig;
pub use gaze_model::GazeModel;
pub use gaze_training::{LabelledStream, StreamContact, StreamFilters};
pub use look_shares::{LOOK_AGES_S, LookShares, LookTable, ReachPhase, TargetShares};
pub use prediction::{ContactPrediction, PredictionSource, Predictor, PredictorInput};
pub use resting_hand::RestingHand;
pub use steady_point::SteadyPoint;
pub use stream::{ReachBeginning, StreamEstimator};
