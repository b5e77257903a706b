//! Which surface is about to be touched, where and when: by one ray, or by all evidence.

mod deterministic;
mod face_moments;
mod fused;
mod fused_config;
mod gaussian;
pub mod gaze;
mod hand;
mod prediction;
mod regions;
mod repeats;
mod steady_point;
mod stream;
mod surface_shares;

pub use deterministic::{DeterministicConfig, DeterministicPredictor, RayLead};
pub use fused::{Experience, FusedPredictor, TargetLook};
pub use fused_config::FusedConfig;
pub use gaze::{
    GazeModel, LabelledStream, LookShares, LookTable, RestingHand, StreamContact, StreamFilters,
    TargetShares,
};
pub use hand::phase::ReachPhase;
pub use prediction::{ContactPrediction, PredictionSource, Predictor, PredictorInput};
pub use regions::{REGION_SHARES, RegionModel, RegionSizes};
pub use steady_point::SteadyPoint;
pub use stream::{ReachBeginning, StreamEstimator};
