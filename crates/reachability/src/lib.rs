#![doc = include_str!("../README.md")]

mod error;
pub mod line;
pub mod map;
pub mod optimization;
pub mod placement;
pub mod polygon;
mod progress;
mod wall;

pub use error::ReachabilityError;
pub use line::{
    ExactConfig, ExactSolver, Interval, LineReach, ReachInterval, Roll, Touch,
    orientation_margin_rad, position_margin_m,
};
#[cfg(feature = "exr")]
pub use map::PictureConfig;
pub use map::{
    BuildReport, Capsule, Carried, KeepOutBox, LineIndex, LookUp, MOST_LINES, Plate,
    ReachabilityMap, ReachabilityReasons, Steps, WallGrid,
};
pub use optimization::{Extreme, LineExtremes, OptimizationConfig, OptimizationSolver};
pub use placement::{
    Placement, PlacementCell, PlacementConfig, PlacementScores, Target, place_base,
    place_base_monitored,
};
pub use polygon::{PolygonConfig, RegionProof, WallPolygon, WallRegion};
pub use progress::{Monitor, Progress};
pub use wall::{WallLine, WallPlane, WallPoint};
