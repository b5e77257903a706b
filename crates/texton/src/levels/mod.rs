//! Orientations and speeds as levels of roughness: measured in a study, tested for discriminability, chosen for virtual textures.
//!
//! # What a level is
//!
//! - A calibration is defined only within the convex hull of its conditions.
//! - The speed of a level is the board's speed against the scan: a resting finger feels v, a finger scanning at s feels s + v.

mod calibration;
mod calibration_csv;
mod discriminable;
mod encoding;
mod level;

pub use calibration::{Calibration, CalibrationNode};
pub use discriminable::discriminable;
pub use encoding::Encoding;
pub use level::{Level, LevelTable};
