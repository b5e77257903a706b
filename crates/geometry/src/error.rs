//! The one error type of the crate.

use hwall_numeric::ArgumentError;

/// Why numbers are not a pose.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// An argument is NaN or infinite.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A matrix or quaternion is not a rotation.
    #[error("not a rotation: {deviation} away from one")]
    NotARotation {
        /// Largest entry of `RᵀR - 1`; 2 for a mirror.
        deviation: f64,
    },
    /// A matrix of four rows is not homogeneous.
    #[error("the last row of the matrix is {row:?}, not [0, 0, 0, 1]: is it transposed?")]
    LastRow {
        /// The row.
        row: [f64; 4],
    },
    /// A vector is too short to point anywhere.
    #[error("{what} of length {length} has no direction")]
    NoDirection {
        /// Name of the argument.
        what: &'static str,
        /// Its length.
        length: f64,
    },
}
