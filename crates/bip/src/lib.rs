#![doc = include_str!("../README.md")]

mod basis;
pub mod compat;
mod demonstration;
mod dense;
mod ensemble;
mod ensemble_update;
mod error;
mod filter;
mod members;
mod model;
mod observation;
mod orthonormal;
mod posterior;
mod projector;
mod selection;
mod square_root;
mod training;

pub use basis::Basis;
pub use demonstration::Demonstration;
pub use ensemble::{EnsembleConfig, EnsembleFilter, EnsembleUpdate};
pub use error::BipError;
pub use filter::{Filter, FilterConfig, NoiseSource};
pub use model::{Group, Model, PhaseVelocity, Prior, Role};
pub use observation::{Observation, Update};
pub use posterior::TimeToEnd;
pub use selection::{
    Criterion, Score, SelectionConfig, at_edge, default_candidates, score_bases, select_basis,
    select_groups,
};
pub use training::{PhaseRate, TrainingConfig};
