//! How a textured board turns and moves under a finger.
//!
//! # What a finger feels, and for how long
//!
//! - A resting finger feels its texture until the stroke (80 mm by default) is used up: two seconds at 40 mm/s, then
//!   `Limit::Stroke`. Out of contact the roll follows the expected scan at once and may jump; the controller of the arm must limit
//!   that motion.
//! - The motion is a board's motion in the plane of a surface (metres, seconds, time as an argument). Arms and forces are not
//!   modelled.

mod limits;
mod scan_estimate;
mod texture_motion;

pub use limits::MotionLimits;
pub use scan_estimate::{ScanConfig, ScanEstimator};
pub use texture_motion::{FingerState, Limit, MotionStep, Stroke, TextureMotion};
