#![doc = include_str!("../README.md")]

mod board;
mod error;
mod length;
mod passage;
mod presentation;
mod strain;
mod surfaces;
mod target;

pub mod atlas;
pub mod base;
pub mod placement;
pub mod waiting;

pub use board::BoardExtent;
pub use error::ArrivalError;
pub use passage::{BLOCKED_S_PER_M, ClearanceConfig};
pub use strain::StrainConfig;
pub use surfaces::Surfaces;
pub use target::{TouchRange, WallShare, WeightedTarget, targets_of_facets, targets_of_maps};

// A configuration for every place.
pub use atlas::{Atlas, AtlasConfig, AtlasEntry, AtlasNode, AtlasWall, NodePlace};
// Where to wait.
pub use waiting::{
    PostureArrivals, WaitingConfig, WaitingPosture, judge_posture, waiting_posture,
    waiting_posture_from, waiting_posture_of_maps,
};
// Where to stand.
pub use placement::{
    ArrivalPlacement, ArrivalPlacementConfig, ArrivalPlacements, place_base_by_arrival,
    place_base_by_arrival_monitored,
};

// What public signatures name.
pub use glam;
pub use hwall_kinematics as kinematics;
pub use hwall_motion as motion;
pub use hwall_numeric::ArgumentError;
pub use hwall_reachability as reachability;
