//! Base placement by arrival time.

mod config;
mod search;

pub use config::ArrivalPlacementConfig;
pub use search::{
    ArrivalPlacement, ArrivalPlacements, place_base_by_arrival, place_base_by_arrival_monitored,
};
