#![doc = include_str!("../README.md")]

mod error;
mod joints;
mod pose;

pub use error::KinematicsError;
pub use joints::{JointLimit, JointPositions, JointTorques, JointVelocities};
pub use pose::{Pose, ROTATION_TOLERANCE, Twist, Wrench, rotation_vector};
