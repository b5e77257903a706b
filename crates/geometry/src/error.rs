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
        /// Largest entry of `RᵀR - 1`; 2 for a reflection.
        deviation: f64,
    },
    /// The last row of a 4 x 4 matrix is not 0, 0, 0, 1.
    #[error("the last row of the matrix is {row:?}, not [0, 0, 0, 1]: is it transposed?")]
    LastRow {
        /// The row.
        row: [f64; 4],
    },
    /// A vector is too short to define a direction.
    #[error("{what} of length {length} has no direction")]
    NoDirection {
        /// Name of the argument.
        what: &'static str,
        /// Length of the vector.
        length: f64,
    },
}
