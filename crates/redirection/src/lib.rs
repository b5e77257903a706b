#![doc = include_str!("../README.md")]

mod angle;
mod avatar_turn;
mod error;
mod orientations;
mod reach;
mod reach_thresholds;
mod walking_thresholds;

pub use angle::wrapped_rad;
pub use avatar_turn::{AvatarTurn, PersonMotion, TurnConfig, TurnStep};
pub use error::RedirectionError;
pub use orientations::{SampledOrientations, Snapped};
pub use reach::{RedirectedReach, VirtualHand};
pub use reach_thresholds::{ReachFrame, ReachShift, ReachThresholds};
pub use walking_thresholds::WalkingThresholds;

pub use glam;
pub use hwall_numeric::ArgumentError;
