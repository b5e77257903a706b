//! An arm at torque level: rigid bodies, joint friction, inner torque loop, sensors and controller; and the hand that pushes its board.

mod arm;
mod config;
mod drive;
mod friction;
mod hand_body;
mod held;
mod motion;
mod moving_chain;
mod observer;
mod rk4;
mod sensor;
mod servo;
mod steps;

pub use arm::TorqueArm;
pub use config::{DriveConfig, PositionServo, TorqueConfig};
pub use friction::{FrictionCompensation, JointFriction};
pub use hand_body::{HandBody, HandBodyConfig, HandDrive};
pub use held::{HeldTorques, MotionSample, MotionSampling, sample_motion};
pub use motion::{ChainMotion, ChainMotionConfig, Integrator};
pub use sensor::TorqueSensor;
