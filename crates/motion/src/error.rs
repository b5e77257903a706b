//! The one error type of the crate.

/// An invalid limit, state or goal, or no motion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// A number is NaN, infinite or outside its range.
    #[error(transparent)]
    Argument(#[from] hwall_numeric::ArgumentError),
    /// The solver found no motion to consider; the current motion continues.
    #[error("no motion was found from a speed of up to {speed_rad_per_s} rad/s")]
    NoMotion {
        /// The largest speed of a joint at the start, rad/s.
        speed_rad_per_s: f64,
    },
}
