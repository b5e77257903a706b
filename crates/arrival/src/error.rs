//! The one error type of the crate.

use hwall_reachability::BinaryFileError;
use std::path::{Path, PathBuf};

/// What can be wrong with a request or a file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArrivalError {
    /// A number is NaN, infinite or outside its range.
    #[error(transparent)]
    Argument(#[from] hwall_numeric::ArgumentError),
    /// A list that must hold something is empty.
    #[error("no {what}")]
    Empty {
        /// The list.
        what: &'static str,
    },
    /// No wall is near enough to the arm, or the arm stands on the person's side of all of them.
    #[error("no wall in front of the arm is near enough")]
    NoWalls,
    /// There are walls or targets, but the arm can hold the board at none of their places.
    #[error("no place is within reach, of {places} tried")]
    OutOfReach {
        /// How many were tried.
        places: usize,
    },
    /// A waiting posture that the arm cannot take.
    #[error("waiting posture: joint {joint} at {value_rad} rad, outside [{min_rad}, {max_rad}]")]
    WaitingOutsideLimits {
        /// Joint, from 0.
        joint: usize,
        /// Its angle, rad.
        value_rad: f64,
        /// Lower limit, rad.
        min_rad: f64,
        /// Upper limit, rad.
        max_rad: f64,
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
    /// A file that is no atlas, one of a later version, or a damaged one.
    #[error("atlas: {0}")]
    Atlas(#[from] BinaryFileError),
    /// An atlas of an arm without a closed form.
    #[error("an atlas of an arm without a closed form is not kept in a file: make it again")]
    NotStored,
    /// Limits of motion that make no sense.
    #[error(transparent)]
    Motion(#[from] hwall_motion::MotionError),
    /// A wall, a target or a grid of bases that makes no sense.
    #[error(transparent)]
    Reachability(#[from] hwall_reachability::ReachabilityError),
    /// A pose that is not valid.
    #[error(transparent)]
    Geometry(#[from] hwall_geometry::GeometryError),
}

impl ArrivalError {
    pub(crate) const fn malformed(what: &'static str) -> Self {
        Self::Atlas(BinaryFileError::Malformed { what })
    }

    pub(crate) fn file(path: &Path, error: &std::io::Error) -> Self {
        Self::File {
            path: path.to_owned(),
            kind: error.kind(),
            message: error.to_string(),
        }
    }
}
