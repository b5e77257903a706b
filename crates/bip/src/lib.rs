#![doc = include_str!("../README.md")]

mod bank;
mod bank_posterior;
mod basis;
mod branching;
pub mod compat;
mod demonstration;
mod dense;
mod ensemble;
mod ensemble_update;
mod error;
mod evaluation;
#[cfg(feature = "serde")]
mod file;
mod filter;
mod fit;
mod gate;
mod health;
mod held_out;
mod members;
mod mixture;
mod model;
mod motion_filter;
mod observation;
mod onset;
mod orthonormal;
mod past;
mod posterior;
mod projector;
mod selection;
mod spread;
mod square_root;
mod threads;
mod trainer;
mod training;
mod transition;
mod tuning;

pub use bank::{Bank, BankConfig, Mode};
pub use bank_posterior::HypothesisView;
pub use basis::Basis;
pub use demonstration::Demonstration;
pub use ensemble::{EnsembleConfig, EnsembleFilter, EnsembleUpdate};
pub use error::BipError;
pub use evaluation::{EndPrediction, Evaluation, EvaluationConfig, follow, leave_one_out};
pub use filter::{Filter, FilterConfig, NoiseSource};
pub use gate::Gate;
pub use health::Health;
pub use mixture::{Covariance, Grouping, Mixture};
pub use model::{Group, Model, PhaseVelocity, Prior, Role, Tuning};
pub use motion_filter::MotionFilter;
pub use observation::{Observation, Update};
pub use onset::Onset;
pub use posterior::TimeToEnd;
pub use selection::{
    Criterion, Score, SelectionConfig, at_edge, default_candidates, score_bases, select_basis,
    select_groups,
};
pub use trainer::{DemonstrationId, Trainer};
pub use training::{PhaseRate, Shrinkage, TrainingConfig};
pub use tuning::{Trial, TuningConfig, tune};
