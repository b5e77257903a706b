#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod baseline;
mod error;
mod estimate;
pub mod learned;
mod matrices;
pub mod predict;
mod reach_set;
mod regression;
pub mod score;
mod slope;

pub use baseline::{ConstantVelocity, Hold, MinimumJerk, NearestNeighbour, RidgeWindow};
pub use error::ContactError;
pub use estimate::{ContactEstimate, ContactEstimator, TimeToContact};
pub use glam;
pub use hwall_bip;
pub use hwall_hand;
pub use hwall_numeric::ArgumentError;
pub use hwall_scene;
pub use learned::{
    Combination, Frame, HeldOutEstimator, HeldOutReach, LearnedConfig, LearnedEstimator,
    LearnedModel,
};
pub use predict::{
    ContactPrediction, DeterministicConfig, DeterministicPredictor, EvidenceModel, EvidenceSource,
    Experience, FusedConfig, FusedPredictor, LabelledStream, PredictionSource, Predictor,
    PredictorInput, ReachBeginning, ReachPhase, RestingHand, SourceShares, StreamContact,
    StreamEstimator, StreamFilters,
};
