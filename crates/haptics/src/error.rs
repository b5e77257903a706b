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
    /// An argument is NaN or infinite.
    #[error("{what}[{index}] is {value}, not a finite number")]
    NonFinite {
        /// The argument.
        what: &'static str,
        /// Its place in the argument.
        index: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// A normal is too short to point anywhere.
    #[error("a normal of length {length} has no direction")]
    NoDirection {
        /// Its length.
        length: f64,
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
    /// An arm model is not valid.
    #[error(transparent)]
    Kinematics(#[from] hwall_kinematics::KinematicsError),
    /// A pose is not valid.
    #[error(transparent)]
    Geometry(#[from] hwall_kinematics::GeometryError),
}

pub(crate) fn finite(what: &'static str, values: &[f64]) -> Result<(), HapticsError> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(HapticsError::NonFinite {
            what,
            index,
            value: values[index],
        }),
    }
}

pub(crate) fn positive(what: &'static str, value: f64) -> Result<(), HapticsError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(HapticsError::Parameter {
        what,
        value,
        wanted: "positive",
    })
}

pub(crate) fn non_negative(what: &'static str, value: f64) -> Result<(), HapticsError> {
    if value >= 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(HapticsError::Parameter {
        what,
        value,
        wanted: "at least 0",
    })
}
