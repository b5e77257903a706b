//! The lines of whole walls, solved once for look-ups.

mod file;
mod grid;
mod keep_out;
#[cfg(feature = "exr")]
mod picture;
mod plane_map;
mod reachability_map;
mod reasons;
mod symmetry;
mod wall_maps;
mod zonotope;

pub use grid::{BuildReport, WallGrid};
pub(crate) use grid::{GridLines, checked_line_count};
pub use keep_out::{Capsule, Carried, KeepOut, KeepOutBox, Plate};
#[cfg(feature = "exr")]
pub use picture::PictureConfig;
pub use plane_map::PlaneMap;
pub(crate) use reachability_map::LEAST_COSINE_SQUARED;
pub use reachability_map::{LineIndex, LookUp, MapLengths, ReachabilityMap};
pub use reasons::ReachabilityReasons;
pub use wall_maps::{Presented, WallFacet, WallMaps, WallMapsConfig};
