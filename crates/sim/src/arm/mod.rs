//! An arm at servo level and one at torque level, and the fingertip or the hand that presses its board.

mod config;
mod hand_contact;
mod servo;
mod stream;
mod tool;
mod torque;
mod tracking;

pub use config::ServoConfig;
pub use hand_contact::HandContact;
pub use servo::ServoArm;
pub use torque::{
    ChainMotion, ChainMotionConfig, DriveConfig, FrictionCompensation, HandBody, HandBodyConfig,
    HandDrive, HeldTorques, Integrator, JointFriction, MotionSample, MotionSampling, PositionServo,
    TorqueArm, TorqueConfig, TorqueSensor, sample_motion,
};
