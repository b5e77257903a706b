//! The one error type of the crate.

/// What can be wrong with a command, a configuration or a plan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// A number is NaN or infinite.
    #[error("{what}[{index}] is {value}, not a finite number")]
    NonFinite {
        /// The argument that holds it.
        what: &'static str,
        /// Its place in the argument.
        index: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// A start or commanded position violates a joint limit.
    #[error("joint {joint}: {value_rad} rad outside [{min_rad}, {max_rad}]")]
    JointLimit {
        /// Joint, from 0.
        joint: usize,
        /// Angle given, rad.
        value_rad: f64,
        /// Lower limit, rad.
        min_rad: f64,
        /// Upper limit, rad.
        max_rad: f64,
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
    /// The arm has no such kind of command.
    #[error("the simulated arm does not know this kind of command")]
    UnsupportedCommand,
    /// Bounds of a joint that its motion profile refuses.
    #[error(transparent)]
    Haptics(#[from] hwall_haptics::HapticsError),
    /// More commands wait for the reaction delay to pass than the queue holds.
    #[error("{capacity} commands are waiting already")]
    QueueFull {
        /// Commands that may wait at once.
        capacity: usize,
    },
    /// The resting fingertip is not far enough in front of a planned surface to reach for it.
    #[error(
        "touch {touch}: the resting fingertip is {height_m} m in front of the surface, it needs {needed_m} m"
    )]
    BehindSurface {
        /// Index in the plan.
        touch: usize,
        /// Distance of the resting fingertip along the normal, m; negative behind.
        height_m: f64,
        /// Least distance, m.
        needed_m: f64,
    },
}

/// Rejects NaN and infinities, naming the argument and the place.
pub(crate) fn finite(what: &'static str, values: &[f64]) -> Result<(), SimError> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(SimError::NonFinite {
            what,
            index,
            value: values[index],
        }),
    }
}

/// Rejects what is not finite and above zero.
pub(crate) fn positive(what: &'static str, value: f64) -> Result<(), SimError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(SimError::Parameter {
        what,
        value,
        wanted: "finite and above 0",
    })
}

/// Rejects what is not finite and at least zero.
pub(crate) fn not_negative(what: &'static str, value: f64) -> Result<(), SimError> {
    if value >= 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(SimError::Parameter {
        what,
        value,
        wanted: "finite and at least 0",
    })
}
