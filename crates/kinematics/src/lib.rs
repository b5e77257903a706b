#![doc = include_str!("../README.md")]

mod error;
mod forward;
mod joints;
mod pose;
mod srs;
mod window;

pub use error::KinematicsError;
pub use forward::Jacobian;
pub use joints::{JointLimit, JointPositions, JointTorques, JointVelocities};
pub use pose::{Pose, ROTATION_TOLERANCE, Twist, Wrench, rotation_vector};
pub use srs::{SrsArm, SrsGeometry, SrsParameters};
