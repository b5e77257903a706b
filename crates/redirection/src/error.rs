//! The one error type of the crate.

use hwall_geometry::GeometryError;
use hwall_numeric::ArgumentError;

/// Errors of invalid requests.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what the fields hold")]
pub enum RedirectionError {
    /// A number is NaN, infinite or outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A vector without a direction.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// The hand is already at its goal: there is no reach to shift.
    #[error("no reach: {length_m} m from the start to the goal")]
    NoReach { length_m: f64 },
    /// The reach starts on or behind the surface.
    #[error("the reach starts {before_m} m before the board")]
    NotBefore { before_m: f64 },
    /// A shift that people would notice.
    #[error("{what} of the shift is {value}, unnoticed are {least} to {most}")]
    Noticed {
        what: &'static str,
        value: f64,
        least: f64,
        most: f64,
    },
}

/// Result with the error of this crate.
pub(crate) type Result<T, E = RedirectionError> = std::result::Result<T, E>;
