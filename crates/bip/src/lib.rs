#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

// Parts of a model.
pub mod basis;
pub mod model;
#[cfg(feature = "serde")]
pub mod model_file;

// From demonstrations to a model.
pub mod train;

// Filters.
pub mod bank;
pub mod ensemble;
pub mod filter;

// How good they are, and which parameters are best.
pub mod judge;

mod arithmetic;
mod error;

pub use bank::{Bank, BankConfig, Component, Covariance, HypothesisView, Mixture, Mode};
pub use basis::Basis;
pub use ensemble::{EnsembleConfig, EnsembleFilter, EnsembleUpdate};
pub use error::BipError;
pub use filter::{Filter, FilterConfig, Gate, Health, NoiseSource, Observation, TimeToEnd, Update};
pub use hwall_numeric::ArgumentError;
pub use judge::{
    Criterion, EndPrediction, Evaluation, EvaluationConfig, MotionFilter, SelectionConfig,
    TimePrediction, Trial, Tuned, TuningConfig, default_candidates, follow, leave_one_out,
    select_groups, tune,
};
pub use model::{Group, Model, PhaseVelocity, Prior, Role, Tuning};
pub use train::{Demonstration, DemonstrationId, Onset, PhaseRate, Trainer, TrainingConfig};
