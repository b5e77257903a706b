//! The reachable part of a wall as polygons with holes.

mod contour;
mod proof;
mod region;
mod rings;
mod strips;
mod triangulation;

pub use proof::RegionProof;
pub use region::{PolygonConfig, WallPolygon, WallRegion};
