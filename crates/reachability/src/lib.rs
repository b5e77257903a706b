#![doc = include_str!("../README.md")]

mod error;
mod exact;
mod grid;
mod interval;
mod line_reach;
mod map;
mod search;
mod symmetry;
mod threads;
mod wall;

pub use error::ReachabilityError;
pub use exact::{ExactConfig, ExactSolver, Roll, Touch};
pub use grid::{MOST_LINES, Steps, WallGrid};
pub use interval::Interval;
pub use line_reach::{LineReach, ReachInterval};
pub use map::{BuildReport, LineIndex, LookUp, ReachabilityMap};
pub use threads::{Monitor, Progress};
pub use wall::{WallLine, WallPlane, WallPoint};
