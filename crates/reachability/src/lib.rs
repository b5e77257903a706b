#![doc = include_str!("../README.md")]

mod error;
mod exact;
mod interval;
mod line_reach;
mod search;
mod wall;

pub use error::ReachabilityError;
pub use exact::{ExactConfig, ExactSolver, Roll, Touch};
pub use interval::Interval;
pub use line_reach::{LineReach, ReachInterval};
pub use wall::{WallLine, WallPlane, WallPoint};
