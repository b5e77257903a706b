#![doc = include_str!("../README.md")]

mod config;
mod draw;
mod error;
mod gaze;
mod gesture;
mod person;
mod population;
mod profile;
mod reach;
mod sequence;
mod servo;
mod touch;

pub use config::PersonConfig;
pub use error::SimError;
pub use gesture::Gesture;
pub use person::Person;
pub use population::Population;
pub use profile::minimum_jerk;
pub use reach::{ChangeOfMind, ReachPlan, TouchPlan, TouchTruth};
pub use sequence::{PersonSample, TouchSequence};
pub use servo::{ServoArm, ServoConfig};
pub use touch::HandContact;

pub use hwall_hand as hand;
pub use hwall_haptics as haptics;
pub use hwall_kinematics::{self as kinematics, glam};
pub use hwall_numeric::ArgumentError;
