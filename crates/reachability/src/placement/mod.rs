//! Where the base should stand for a set of targets.

mod base;
mod config;
mod problem;
mod scores;
mod search;
mod size_limits;
mod target;

pub use base::place_base;
pub use config::PlacementConfig;
pub use scores::{Placement, PlacementCell, PlacementScores};
pub use target::Target;
