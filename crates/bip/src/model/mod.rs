//! The result of training: everything that a filter needs.

#[cfg(feature = "serde")]
mod file;
mod group;
mod layout;
mod prior;
mod trained;
mod tuning;

pub use group::{Group, Role};
pub(crate) use layout::WeightLayout;
pub use prior::{PhaseVelocity, Prior};
pub use trained::Model;
pub(crate) use trained::ModelParts;
pub use tuning::Tuning;
