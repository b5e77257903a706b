//! The one error type of the crate.

use hwall_reachability::BinaryFileError;
use std::path::{Path, PathBuf};

/// Errors in requests or files.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArrivalError {
    /// A number is NaN, infinite or outside its range.
    #[error(transparent)]
    Argument(#[from] hwall_numeric::ArgumentError),
    /// A required list is empty.
    #[error("no {what}")]
    Empty {
        /// The list.
        what: &'static str,
    },
    /// No wall is near enough to the arm, or the arm stands on the person's side of all of them.
    #[error("no wall in front of the arm is near enough")]
    NoWalls,
    /// There are walls or targets, but the arm can present the board at none of them.
    #[error("no place is within reach, of {places} tried")]
    OutOfReach {
        /// Number of places tried.
        places: usize,
    },
    /// The arm cannot take the waiting posture.
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
    /// Too many of something; detected before any memory is allocated.
    #[error("{count} {what}, at most {limit} are allowed")]
    TooMany {
        /// The item.
        what: &'static str,
        /// Its count.
        count: u128,
        /// The limit.
        limit: u128,
    },
    /// A file cannot be read or written.
    #[error("{path}: {message}")]
    File {
        /// The file.
        path: PathBuf,
        /// Kind of failure.
        kind: std::io::ErrorKind,
        /// Message of the operating system.
        message: String,
    },
    /// The file is not an atlas, has a later version, or is damaged.
    #[error("atlas: {0}")]
    Atlas(#[from] BinaryFileError),
    /// An atlas of an arm without a closed form cannot be saved.
    #[error("an atlas of an arm without a closed form is not kept in a file: make it again")]
    NotStored,
    /// Invalid motion limits.
    #[error(transparent)]
    Motion(#[from] hwall_motion::MotionError),
    /// An invalid wall, target or grid of bases.
    #[error(transparent)]
    Reachability(#[from] hwall_reachability::ReachabilityError),
    /// An invalid pose.
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
