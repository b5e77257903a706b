//! The one error type of the crate.

/// What is wrong with a limit, a state or a goal.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// A number is NaN, infinite or outside its range.
    #[error(transparent)]
    Argument(#[from] hwall_numeric::ArgumentError),
    /// The solver found no motion that could be considered; the motion in force goes on.
    #[error("no motion was found from a speed of up to {speed_rad_per_s} rad/s")]
    NoMotion {
        /// The largest speed of a joint at the start, rad/s.
        speed_rad_per_s: f64,
    },
}
