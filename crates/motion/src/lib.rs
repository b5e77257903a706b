#![doc = include_str!("../README.md")]

mod error;
mod joint;
mod joint_state;
mod limits;
mod plan;
mod reference;
mod solver;
mod travel_time;
mod under_way;

pub use error::MotionError;
pub use joint::{JointBounds, JointPoint};
pub use joint_state::JointState;
pub use limits::{IIWA7_ACCELERATION_RAD_PER_S2, MotionConfig, MotionLimits};
pub use plan::MotionPlan;
pub use reference::ReferenceMotion;
pub use solver::JointTiming;
pub use under_way::UnderWay;

pub use hwall_kinematics as kinematics;
pub use hwall_numeric::ArgumentError;
