#![doc = include_str!("../README.md")]

mod arm;
mod error;

pub use arm::{Arm, ArmCommand, ArmState};
pub use error::HapticsError;
