#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

// Used by everything below: walls and their lines, planes at any inclination, evenly spaced values, long loops.
mod plane;
mod progress;
mod steps;
mod wall;

mod binary_file;
mod error;

pub mod line;
pub mod map;
pub mod optimization;
pub mod placement;
pub mod polygon;

pub use binary_file::{BinaryFileError, BinaryFormat};
pub use error::ReachabilityError;
pub use plane::{Plane, PlaneLine};
pub use progress::{Monitor, Progress};
pub use steps::Steps;
pub use wall::{WallLine, WallPlane, WallPoint, WallProjection};

// One line of a wall, exact.
pub use line::{
    BoardPart, ExactConfig, ExactSolver, HeldStretch, Interval, LineReachability,
    ReachableInterval, Roll, orientation_margin_rad, position_margin_m,
};
// The lines of whole walls.
#[cfg(feature = "exr")]
pub use map::PictureConfig;
pub use map::{
    BuildReport, Capsule, Carried, KeepOut, KeepOutBox, LineIndex, LookUp, MapLengths, PlaneMap,
    Plate, Presented, ReachabilityMap, ReachabilityReasons, WallFacet, WallGrid, WallMaps,
    WallMapsConfig,
};
// The extremes of lines and walls for any arm.
pub use optimization::{ChainMap, Extreme, LineExtremes, OptimizationConfig, OptimizationSolver};
// Where the base should stand.
pub use placement::{
    Placement, PlacementCell, PlacementConfig, PlacementScores, Target, place_base,
};
// Outlines.
pub use polygon::{PolygonConfig, RegionProof, WallPolygon, WallRegion};

// Crates that appear in public signatures.
pub use glam;
pub use hwall_kinematics;
pub use hwall_numeric::ArgumentError;
