#![doc = include_str!("../README.md")]

mod ascent;
mod contour;
mod error;
mod exact;
mod file;
mod grid;
mod interval;
mod keep_out;
mod linalg;
mod line_reach;
mod map;
mod margin;
mod nearest;
mod optimization;
#[cfg(feature = "exr")]
mod picture;
mod placement;
mod placement_scene;
mod placement_search;
mod polygon;
mod reasons;
mod region_proof;
mod rings;
mod search;
mod strips;
mod symmetry;
mod threads;
mod triangulation;
mod wall;

pub use error::ReachabilityError;
pub use exact::{ExactConfig, ExactSolver, Roll, Touch};
pub use grid::{MOST_LINES, Steps, WallGrid};
pub use interval::Interval;
pub use keep_out::{Capsule, Carried, KeepOutBox, Plate};
pub use line_reach::{LineReach, ReachInterval};
pub use map::{BuildReport, LineIndex, LookUp, ReachabilityMap};
pub use margin::{orientation_margin_rad, position_margin_m};
pub use optimization::{Extreme, LineExtremes, OptimizationConfig, OptimizationSolver};
#[cfg(feature = "exr")]
pub use picture::PictureConfig;
pub use placement::{
    Placement, PlacementCell, PlacementConfig, PlacementScores, Target, place_base,
    place_base_monitored,
};
pub use polygon::{PolygonConfig, WallPolygon, WallRegion};
pub use reasons::ReachabilityReasons;
pub use region_proof::RegionProof;
pub use threads::{Monitor, Progress};
pub use wall::{WallLine, WallPlane, WallPoint};
