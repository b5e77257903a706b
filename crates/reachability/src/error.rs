//! The one error type of the crate.

use crate::binary_file::BinaryFileError;
use std::path::{Path, PathBuf};

/// What can be wrong with a request, a grid or a file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReachabilityError {
    /// A number is NaN, infinite or outside its range.
    #[error(transparent)]
    Argument(#[from] hwall_numeric::ArgumentError),
    /// A normal that should be horizontal is not.
    #[error("the wall's normal leans by {lean_rad} rad from horizontal")]
    NotVertical {
        /// Angle between the normal and the horizontal plane, rad.
        lean_rad: f64,
    },
    /// A list that must hold something is empty.
    #[error("no {what}")]
    Empty {
        /// The list.
        what: &'static str,
    },
    /// More of something than fits; found before any memory is taken.
    #[error("{count} {what}, at most {limit} are allowed")]
    TooMany {
        /// What was asked for.
        what: &'static str,
        /// How many.
        count: u128,
        /// The limit.
        limit: u128,
    },
    /// Keep-out boxes were asked for in a map where any part of the board may be at the wall: the
    /// place of its middle is then not known.
    #[error("keep-out boxes need a map for the middle of the board")]
    NotBoardMiddle,
    /// A file cannot be read or written.
    #[error("{path}: {message}")]
    File {
        /// The file.
        path: PathBuf,
        /// What kind of failure it is.
        kind: std::io::ErrorKind,
        /// What the operating system reports.
        message: String,
    },
    /// Not a reachability map at all.
    #[error("no reachability map: it does not begin as one")]
    ForeignFile,
    /// Written by a later version of this crate.
    #[error("map of format {found}, this version knows formats up to {known}")]
    NewerFile {
        /// Format of the file.
        found: u16,
        /// The latest that is known.
        known: u16,
    },
    /// The file ends too early, or goes on too long.
    #[error("{found} bytes where the map's header promises {expected}")]
    WrongFileLength {
        /// Bytes that the header promises.
        expected: u64,
        /// Bytes there are.
        found: u64,
    },
    /// The checksum does not match: some bytes have changed.
    #[error("damaged map: checksum {found:08x} instead of {expected:08x}")]
    DamagedFile {
        /// Checksum in the file.
        expected: u32,
        /// Checksum of its bytes.
        found: u32,
    },
    /// The bytes are as written, but what they say makes no sense.
    #[error("malformed map: {what}")]
    MalformedFile {
        /// The part that makes no sense.
        what: &'static str,
    },
    /// The outline of a region crosses itself, so that it cannot be triangulated.
    #[error("a region with {edges} edges cannot be triangulated")]
    Triangulation {
        /// Edges of its outline and holes.
        edges: usize,
    },
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

impl From<BinaryFileError> for ReachabilityError {
    fn from(error: BinaryFileError) -> Self {
        match error {
            BinaryFileError::Foreign => Self::ForeignFile,
            BinaryFileError::Newer { found, known } => Self::NewerFile { found, known },
            BinaryFileError::WrongLength { expected, found } => {
                Self::WrongFileLength { expected, found }
            }
            BinaryFileError::Damaged { expected, found } => Self::DamagedFile { expected, found },
            BinaryFileError::Malformed { what } => Self::MalformedFile { what },
        }
    }
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
