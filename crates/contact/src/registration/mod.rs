//! How far off the registration of a tracker is, learnt from touches.

mod config;
mod estimator;
mod fit;
mod touch;

pub use config::RegistrationConfig;
pub use estimator::RegistrationEstimator;
pub use touch::{MeasuredTouch, TouchVerdict};
