//! From places of the board to joint commands within the limits of the arm.

mod barrier;
mod between;
mod follower;
mod goals;
mod lean;
mod link;
mod planner;
mod profile;
mod route;
mod search;
mod slide;
mod solver;
mod way;

pub use barrier::{Barrier, BarrierTree};
pub use follower::{Follower, FollowerConfig};
pub use planner::{Planner, PlannerConfig};
pub use profile::{JointBounds, JointMotion};
pub use route::ApproachConfig;
pub use slide::Slide;
