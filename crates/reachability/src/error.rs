//! The one error type of the crate.

use crate::binary_file::BinaryFileError;
use std::path::{Path, PathBuf};

/// What can be wrong with a request, a grid or a file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what the fields hold")]
pub enum ReachabilityError {
    /// A number is NaN, infinite or outside its range.
    #[error(transparent)]
    Argument(#[from] hwall_numeric::ArgumentError),
    /// A normal that should be horizontal is not.
    #[error("the wall's normal leans by {lean_rad} rad from horizontal")]
    NotVertical { lean_rad: f64 },
    /// A required list is empty.
    #[error("no {what}")]
    Empty { what: &'static str },
    /// A count exceeds its limit; checked before memory is allocated.
    #[error("{count} {what}, at most {limit} are allowed")]
    TooMany {
        what: &'static str,
        count: u128,
        limit: u128,
    },
    /// Keep-out boxes were requested for a map in which any part of the board may be at the wall:
    /// the position of its middle is then unknown.
    #[error("keep-out boxes need a map for the middle of the board")]
    NotBoardMiddle,
    /// A file cannot be read or written.
    #[error("{path}: {message}")]
    File {
        path: PathBuf,
        kind: std::io::ErrorKind,
        message: String,
    },
    /// Bytes that are not a reachability map that this version can read.
    #[error("reachability map: {0}")]
    MapFile(#[from] BinaryFileError),
    /// A picture cannot be written.
    #[error("picture: {message}")]
    Picture { message: String },
    /// The outline of a region crosses itself, so that it cannot be triangulated.
    #[error("a region with {edges} edges cannot be triangulated")]
    Triangulation { edges: usize },
    /// The caller asked to stop.
    #[error("cancelled")]
    Cancelled,
    /// An arm model is not valid.
    #[error(transparent)]
    Kinematics(#[from] hwall_kinematics::KinematicsError),
    /// A pose is not valid.
    #[error(transparent)]
    Geometry(#[from] hwall_kinematics::GeometryError),
}

impl ReachabilityError {
    pub(crate) fn file(path: &Path, error: &std::io::Error) -> Self {
        Self::File {
            path: path.to_owned(),
            kind: error.kind(),
            message: error.to_string(),
        }
    }
}

/// Result with the error of this crate.
pub(crate) type Result<T, E = ReachabilityError> = std::result::Result<T, E>;
