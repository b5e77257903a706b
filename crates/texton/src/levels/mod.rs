//! Orientations and speeds as levels of roughness: measured, told apart, chosen for virtual textures.

mod calibration;
mod calibration_csv;
mod discriminable;
mod encoding;
mod isotonic;
mod level;

pub use calibration::{Calibration, CalibrationNode, Violation};
pub use discriminable::discriminable;
pub use encoding::Encoding;
pub use level::{Level, LevelTable};
