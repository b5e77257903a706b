//! The one error type of the crate.

/// What can be wrong with a request, a grid or a file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReachabilityError {
    /// A value is NaN or infinite.
    #[error("{what} is {value}, not a finite number")]
    NonFinite {
        /// The quantity.
        what: &'static str,
        /// NaN or an infinity.
        value: f64,
    },
    /// A setting is outside its range.
    #[error("{what} is {value}, it must be {wanted}")]
    Parameter {
        /// Name of the setting.
        what: &'static str,
        /// Value given.
        value: f64,
        /// The range it must lie in.
        wanted: &'static str,
    },
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
    /// Keep-out boxes were asked for with a touch anywhere on the board, whose middle is then not
    /// known.
    #[error("keep-out boxes need the touch in the middle of the board")]
    TouchNotInMiddle,
    /// A file cannot be read or written.
    #[error("{path}: {reason}")]
    File {
        /// The file.
        path: std::path::PathBuf,
        /// What kind of failure it is.
        kind: std::io::ErrorKind,
        /// What the system says.
        reason: String,
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

pub(crate) fn finite(what: &'static str, value: f64) -> Result<f64, ReachabilityError> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(ReachabilityError::NonFinite { what, value })
}

pub(crate) fn positive(what: &'static str, value: f64) -> Result<f64, ReachabilityError> {
    if finite(what, value)? > 0.0 {
        return Ok(value);
    }
    Err(ReachabilityError::Parameter {
        what,
        value,
        wanted: "positive",
    })
}

pub(crate) fn non_negative(what: &'static str, value: f64) -> Result<f64, ReachabilityError> {
    if finite(what, value)? >= 0.0 {
        return Ok(value);
    }
    Err(ReachabilityError::Parameter {
        what,
        value,
        wanted: "at least 0",
    })
}
