//! The one error type of the crate.

use glam::DVec3;
use hwall_geometry::ArgumentError;
use hwall_numeric::check::all_finite;
use std::io::ErrorKind;
use std::path::Path;

/// What can be wrong with a scene file, its sidecar or a query.
///
/// A ray that hits nothing is not an error: queries return a `Result` of an `Option`.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what the fields hold")]
pub enum SceneError {
    /// A number of a query is NaN, infinite or out of range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A file cannot be read.
    #[error("{path}: {message}")]
    Io {
        path: String,
        kind: ErrorKind,
        message: String,
    },
    /// A readable file has invalid content.
    #[error("{path}: {error}")]
    File {
        path: String,
        error: Box<SceneError>,
    },
    /// The scene exceeds a limit of [`LoadLimits`](crate::LoadLimits).
    #[error("{got} {what} exceed the limit of {limit}")]
    TooLarge {
        what: &'static str,
        got: u64,
        limit: u64,
    },
    /// The file is not UTF-8 text, so it cannot be an OBJ.
    #[error("not a text file: byte {offset} is not UTF-8")]
    NotText { offset: usize },
    /// A line of the OBJ lacks the numbers that its keyword requires.
    #[error("OBJ line {line}: malformed {keyword:?}")]
    ObjLine { line: usize, keyword: &'static str },
    /// A vertex coordinate is NaN, infinite or beyond [`COORDINATE_LIMIT_M`](crate::COORDINATE_LIMIT_M).
    #[error("OBJ line {line}: vertex coordinate {value} is not usable")]
    ObjVertex { line: usize, value: f64 },
    /// A face refers to a vertex that no earlier line defines.
    #[error("OBJ line {line}: face index {index}, but {vertices} vertices are defined so far")]
    ObjIndex {
        line: usize,
        /// As written in the file: from 1, or counted back from the latest vertex if negative.
        index: i64,
        vertices: usize,
    },
    /// The OBJ parser rejected a text that passed the checks above.
    #[error("OBJ: {message}")]
    Obj { message: String },
    /// No usable face is left.
    #[error("the scene holds no face with an area")]
    NoFaces,
    /// The sidecar is not TOML or has an unknown key.
    #[error("sidecar: {message}")]
    SidecarMalformed { message: String },
    /// The sidecar describes a surface that is not in the OBJ.
    #[error("sidecar: the OBJ has no surface {name:?}")]
    SidecarUnknownSurface { name: String },
    /// A surface entry lacks a key that its kind needs.
    #[error("sidecar: surface {surface:?} of kind {kind} needs {key}")]
    SidecarMissingKey {
        surface: String,
        kind: &'static str,
        key: &'static str,
    },
    /// A surface entry has a key that its kind does not use.
    #[error("sidecar: surface {surface:?} of kind {kind} has no use for {key}")]
    SidecarStrayKey {
        surface: String,
        kind: &'static str,
        key: &'static str,
    },
    /// A property of a surface is outside its range.
    #[error("surface {surface:?}: {what} is {value}, it must be {wanted}")]
    Parameter {
        surface: String,
        what: &'static str,
        value: f64,
        wanted: &'static str,
    },
    /// Two surfaces have the same name.
    #[error("surface {name:?} is defined twice")]
    DuplicateSurface { name: String },
    /// A ray without direction.
    #[error("the ray has no direction")]
    ZeroDirection,
    /// A surface id of another scene.
    #[error("surface {index}, but the scene has {count}")]
    UnknownSurface { index: usize, count: usize },
    /// An opening was requested for a fixed surface.
    #[error("surface {surface:?} does not move")]
    NotMovable { surface: String },
    /// An opening outside the range of its door or panel.
    #[error("surface {surface:?}: opening {value} outside [{min}, {max}]")]
    OpeningOutOfRange {
        surface: String,
        /// rad or m, as the bounds.
        value: f64,
        min: f64,
        max: f64,
    },
}

impl SceneError {
    /// Prefixes the name of the sidecar if there is one and the error can only come from it, and otherwise that of the OBJ.
    pub(crate) fn in_files(self, obj: &Path, sidecar: Option<&Path>) -> Self {
        let sidecar = sidecar.filter(|_| {
            matches!(
                self,
                Self::SidecarMalformed { .. }
                    | Self::SidecarUnknownSurface { .. }
                    | Self::SidecarMissingKey { .. }
                    | Self::SidecarStrayKey { .. }
                    | Self::Parameter { .. }
            )
        });
        self.in_file(sidecar.unwrap_or(obj))
    }

    /// A value of this surface that is not as wanted.
    pub(crate) fn parameter(
        surface: &str,
        what: &'static str,
        value: f64,
        wanted: &'static str,
    ) -> Self {
        Self::Parameter {
            surface: surface.to_owned(),
            what,
            value,
            wanted,
        }
    }

    /// Prefixes the file name, unless already present.
    pub(crate) fn in_file(self, path: &Path) -> Self {
        if matches!(self, Self::Io { .. } | Self::File { .. }) {
            return self;
        }
        Self::File {
            path: path.display().to_string(),
            error: Box::new(self),
        }
    }
}

/// Rejects a scene with more than the limit of something.
pub(crate) const fn at_most(limit: u64, what: &'static str, got: u64) -> Result<()> {
    match got > limit {
        true => Err(SceneError::TooLarge { what, got, limit }),
        false => Ok(()),
    }
}

/// Rejects NaN and infinity in a vector, naming the argument.
pub(crate) fn finite(what: &'static str, v: DVec3) -> Result<DVec3, ArgumentError> {
    all_finite(what, &v.to_array())?;
    Ok(v)
}

/// Result with the error of this crate.
pub(crate) type Result<T, E = SceneError> = std::result::Result<T, E>;
