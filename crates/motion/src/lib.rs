#![doc = include_str!("../README.md")]

mod error;
mod limits;
mod reference;
mod travel_time;

pub use error::MotionError;
pub use limits::{IIWA7_ACCELERATION_RAD_PER_S2, MotionConfig, MotionLimits};
pub use reference::{JointState, JointTiming, ReferenceMotion};

pub use hwall_kinematics as kinematics;
pub use hwall_numeric::ArgumentError;
