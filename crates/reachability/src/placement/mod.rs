//! Where to put the base.

mod base;
mod problem;
mod search;

pub use base::{
    Placement, PlacementCell, PlacementConfig, PlacementScores, Target, place_base,
    place_base_monitored,
};
