#![doc = include_str!("../README.md")]

pub mod arm;
mod error;
pub mod person;

pub use arm::{
    ChainMotion, ChainMotionConfig, DriveConfig, FrictionCompensation, HandBody, HandBodyConfig,
    HandContact, HandDrive, HeldTorques, Integrator, JointFriction, MotionSample, MotionSampling,
    PositionServo, ServoArm, ServoConfig, TorqueArm, TorqueConfig, TorqueSensor, sample_motion,
};
pub use error::SimError;
pub use person::{
    ChangeOfMind, Gesture, Glance, Person, PersonConfig, PersonSample, Population, ReachPlan,
    TouchPlan, TouchSequence, TouchTruth, minimum_jerk,
};

pub use hwall_hand as hand;
pub use hwall_haptics as haptics;
pub use hwall_kinematics::{self as kinematics, glam};
pub use hwall_numeric::ArgumentError;
