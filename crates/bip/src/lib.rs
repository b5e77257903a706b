#![doc = include_str!("../README.md")]

mod basis;
pub mod compat;
mod demonstration;
mod dense;
mod error;
#[cfg(feature = "serde")]
mod file;
mod filter;
mod fit;
mod held_out;
mod model;
mod observation;
mod onset;
mod orthonormal;
mod posterior;
mod projector;
mod spread;
mod square_root;
mod trainer;
mod training;

pub use basis::Basis;
pub use demonstration::Demonstration;
pub use error::BipError;
pub use filter::{Filter, FilterConfig, NoiseSource};
pub use model::{Group, Model, PhaseVelocity, Prior, Role};
pub use observation::{Observation, Update};
pub use onset::Onset;
pub use posterior::TimeToEnd;
pub use trainer::{DemonstrationId, Trainer};
pub use training::{PhaseRate, Shrinkage, TrainingConfig};
