//! Estimators that a learned one must beat.

mod durations;
mod hand_path;
mod minimum_jerk;
mod nearest_neighbour;
mod ridge_window;
mod simple;

pub use minimum_jerk::MinimumJerk;
pub use nearest_neighbour::NearestNeighbour;
pub use ridge_window::RidgeWindow;
pub use simple::{ConstantVelocity, Hold};
