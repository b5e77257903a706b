//! How a textured board turns and moves under a finger.

mod limits;
mod scan_estimate;
mod texture_motion;

pub use limits::MotionLimits;
pub use scan_estimate::{ScanConfig, ScanEstimator};
pub use texture_motion::{FingerState, Limit, MotionStep, Stroke, TextureMotion};
