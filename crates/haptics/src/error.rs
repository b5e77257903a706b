//! The one error type of the crate.

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
    /// A setting is outside its range.
    #[error("{what} is {value}, it must be {wanted}")]
    Parameter {
        /// Name of the setting.
        what: &'static str,
        /// Value given.
        value: f64,
        /// The range it must lie in.
        wanted: &'static str,
    },
    /// A pose or an arm model is not valid.
    #[error(transparent)]
    Kinematics(#[from] hwall_kinematics::KinematicsError),
}
