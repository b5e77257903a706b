//! The one error type of the crate.

/// What is wrong with a limit, a state or a goal.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// A number is NaN, infinite or outside its range.
    #[error(transparent)]
    Argument(#[from] hwall_numeric::ArgumentError),
}
