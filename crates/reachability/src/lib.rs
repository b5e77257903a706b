#![doc = include_str!("../README.md")]

mod error;
mod interval;
mod wall;

pub use error::ReachabilityError;
pub use interval::Interval;
pub use wall::{WallLine, WallPlane, WallPoint};
