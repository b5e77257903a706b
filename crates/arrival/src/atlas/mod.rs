//! One configuration for each place of every wall, chosen jointly.

mod build;
mod candidates;
mod config;
mod file;
mod look_up;
mod refine;
mod sweep;
mod wall;

pub use build::Atlas;
pub use config::AtlasConfig;
pub use look_up::AtlasEntry;
pub use wall::{AtlasNode, AtlasWall, NodePlace};

pub(crate) use build::check_waiting;
pub(crate) use config::{check_arm_angle_step, check_rolls};
