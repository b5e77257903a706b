#![doc = include_str!("../README.md")]

mod error;
mod hand;
mod person;
mod reach;
mod sequence;
mod servo;
mod touch;

pub use error::SimError;
pub use hand::Gesture;
pub use person::{Person, PersonConfig};
pub use reach::{TouchPlan, TouchTruth, minimum_jerk};
pub use sequence::{PersonSample, TouchSequence};
pub use servo::{ServoArm, ServoConfig};
pub use touch::HandContact;
