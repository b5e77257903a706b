//! The reachable part of a horizontal line of a wall: exact, with proof.

mod config;
mod exact;
mod family;
mod images;
mod interval;
mod margin;
mod nearest;
mod reachability;
mod search;

pub use config::{BoardPart, ExactConfig, Roll};
pub use exact::{ExactSolver, HeldStretch};
pub(crate) use family::{Freedom, size_m};
pub(crate) use images::sectors;
pub use interval::Interval;
pub(crate) use interval::total_m;
pub use margin::{orientation_margin_rad, position_margin_m};
pub use reachability::{LineReachability, ReachableInterval};
