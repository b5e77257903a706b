//! The lines of whole walls, solved once and looked up.

mod file;
pub(crate) mod grid;
mod keep_out;
#[cfg(feature = "exr")]
mod picture;
mod reachability_map;
mod reasons;
mod symmetry;

pub use grid::{MOST_LINES, Steps, WallGrid};
pub use keep_out::{Capsule, Carried, KeepOutBox, Plate};
#[cfg(feature = "exr")]
pub use picture::PictureConfig;
pub use reachability_map::{BuildReport, LineIndex, LookUp, ReachabilityMap};
pub use reasons::ReachabilityReasons;
