//! What of a horizontal line of a wall is reachable: exact, with proof.

pub(crate) mod exact;
pub(crate) mod interval;
mod margin;
mod nearest;
pub(crate) mod reachability;
mod search;

pub use exact::{ExactConfig, ExactSolver, Roll, Touch};
pub use interval::Interval;
pub use margin::{orientation_margin_rad, position_margin_m};
pub use reachability::{LineReach, ReachInterval};
