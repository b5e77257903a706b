#![doc = include_str!("../README.md")]

mod error;
mod joint;
mod joint_state;
mod limits;
mod reference;
mod travel_time;

pub use error::MotionError;
pub use joint::{JointBounds, JointPoint};
pub use joint_state::JointState;
pub use limits::{IIWA7_ACCELERATION_RAD_PER_S2, MotionConfig, MotionLimits};
pub use reference::{JointTiming, MotionPlan, ReferenceMotion, UnderWay};

pub use hwall_kinematics as kinematics;
pub use hwall_numeric::ArgumentError;
