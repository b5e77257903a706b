//! What the command line asks for.

pub mod arms;
pub mod floor_pose;
pub mod numbers;
pub mod place;
