#![doc = include_str!("../README.md")]

mod config;
mod draw;
mod error;
mod gaze;
mod hand;
mod person;
mod population;
mod profile;
mod reach;
mod sequence;
mod servo;
mod touch;

pub use config::PersonConfig;
pub use error::SimError;
pub use hand::Gesture;
pub use hwall_hand;
pub use person::Person;
pub use population::Population;
pub use profile::minimum_jerk;
pub use reach::{ChangeOfMind, ReachPlan, TouchPlan, TouchTruth};
pub use sequence::{PersonSample, TouchSequence};
pub use servo::{ServoArm, ServoConfig};
pub use touch::HandContact;
