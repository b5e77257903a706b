//! From places of the board to joint commands within the limits of the arm.

mod follower;
mod profile;
mod slide;
mod solver;

pub use follower::{Follower, FollowerConfig};
pub use profile::{JointBounds, JointMotion};
pub use slide::Slide;
