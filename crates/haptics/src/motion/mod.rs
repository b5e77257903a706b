//! From places of the board to joint commands within the limits of the arm.

mod barrier;
mod between;
mod follower;
mod goals;
mod profile;
mod route;
mod search;
mod slide;
mod solver;
mod way;

pub use barrier::Barrier;
pub use follower::{Follower, FollowerConfig};
pub use profile::{JointBounds, JointMotion};
pub use route::ApproachConfig;
pub use slide::Slide;
