//! The registration error of a tracker, learned from touches.

mod config;
mod estimator;
mod fit;
mod touch;

pub use config::RegistrationConfig;
pub use estimator::RegistrationEstimator;
pub use touch::{MeasuredTouch, TouchVerdict};
