//! The one error type of the crate.

use hwall_geometry::{ArgumentError, GeometryError};
use hwall_kinematics::KinematicsError;

/// What can be wrong with a configuration or a measured state.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HapticsError {
    /// A measured value is NaN or infinite.
    #[error("state: {what} of joint {joint} is {value}")]
    NonFiniteState {
        /// The quantity.
        what: &'static str,
        /// Joint, from 0.
        joint: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// An argument is NaN or infinite, or a setting outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A pose that is not a rigid transform, or a normal without a direction.
    #[error(transparent)]
    Geometry(GeometryError),
    /// An arm model is not valid.
    #[error(transparent)]
    Kinematics(#[from] KinematicsError),
    /// Limits of the motion, or a goal beyond the joint limits.
    #[error(transparent)]
    Motion(#[from] hwall_motion::MotionError),
}

impl From<GeometryError> for HapticsError {
    /// A NaN is the same error wherever it is found.
    fn from(error: GeometryError) -> Self {
        match error {
            GeometryError::Argument(argument) => Self::Argument(argument),
            other => Self::Geometry(other),
        }
    }
}
