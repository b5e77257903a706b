//! The reachable part of a wall as polygons with holes.

mod config;
mod contour;
mod extent;
mod images;
mod proof;
mod region;
mod rings;
mod strips;
mod triangulation;
mod wall_polygon;

pub use config::PolygonConfig;
pub use proof::RegionProof;
pub use region::WallRegion;
pub use wall_polygon::WallPolygon;
