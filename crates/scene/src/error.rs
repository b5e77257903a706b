//! The one error type of the crate.

use glam::DVec3;
use hwall_geometry::ArgumentError;
use hwall_numeric::check::all_finite;
use std::io::ErrorKind;
use std::path::Path;

/// What can be wrong with a scene file, its sidecar or a query.
///
/// "The ray hits nothing" is an answer, not an error: queries return `Option` inside.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A number of a query is NaN, infinite or out of range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A file cannot be read.
    #[error("{path}: {message}")]
    Io {
        /// The file.
        path: String,
        /// What kind of failure it was.
        kind: ErrorKind,
        /// What the system said.
        message: String,
    },
    /// A file that can be read holds something that it must not.
    #[error("{path}: {error}")]
    File {
        /// The OBJ file or its sidecar.
        path: String,
        /// What is wrong with it.
        error: Box<SceneError>,
    },
    /// The scene exceeds a limit of [`LoadLimits`](crate::LoadLimits).
    #[error("{got} {what} exceed the limit of {limit}")]
    TooLarge {
        /// What is counted.
        what: &'static str,
        /// The count, or the first count known to exceed the limit.
        got: u64,
        /// The limit.
        limit: u64,
    },
    /// The file is not UTF-8 text, so it cannot be an OBJ.
    #[error("not a text file: byte {offset} is not UTF-8")]
    NotText {
        /// First byte that is not text.
        offset: usize,
    },
    /// A line of the OBJ does not hold the numbers its keyword asks for.
    #[error("OBJ line {line}: malformed {keyword:?}")]
    ObjLine {
        /// Line, from 1.
        line: usize,
        /// Keyword of the line.
        keyword: &'static str,
    },
    /// A vertex coordinate is NaN, infinite or beyond [`COORDINATE_LIMIT_M`](crate::COORDINATE_LIMIT_M).
    #[error("OBJ line {line}: vertex coordinate {value} is not usable")]
    ObjVertex {
        /// Line, from 1.
        line: usize,
        /// The coordinate.
        value: f64,
    },
    /// A face names a vertex that the lines above it do not define.
    #[error("OBJ line {line}: face index {index}, but {vertices} vertices are defined so far")]
    ObjIndex {
        /// Line, from 1.
        line: usize,
        /// The index as written (from 1, negative counts backwards).
        index: i64,
        /// Vertices defined above the line.
        vertices: usize,
    },
    /// The OBJ parser refused a text that passed the checks above.
    #[error("OBJ: {message}")]
    Obj {
        /// What the parser said.
        message: String,
    },
    /// No usable face is left.
    #[error("the scene holds no face with an area")]
    NoFaces,
    /// The sidecar is not TOML or holds a key that is not known.
    #[error("sidecar: {message}")]
    SidecarMalformed {
        /// The line, from 1, and what the parser said.
        message: String,
    },
    /// The sidecar describes a surface that the OBJ does not hold.
    #[error("sidecar: the OBJ has no surface {name:?}")]
    SidecarUnknownSurface {
        /// The name in the sidecar.
        name: String,
    },
    /// A surface entry lacks a key that its kind needs.
    #[error("sidecar: surface {surface:?} of kind {kind} needs {key}")]
    SidecarMissingKey {
        /// Surface.
        surface: String,
        /// Its kind.
        kind: &'static str,
        /// The missing key.
        key: &'static str,
    },
    /// A surface entry has a key that its kind does not use.
    #[error("sidecar: surface {surface:?} of kind {kind} has no use for {key}")]
    SidecarStrayKey {
        /// Surface.
        surface: String,
        /// Its kind.
        kind: &'static str,
        /// The key.
        key: &'static str,
    },
    /// A property of a surface is outside its range.
    #[error("surface {surface:?}: {what} is {value}, it must be {wanted}")]
    Parameter {
        /// Surface.
        surface: String,
        /// Property.
        what: &'static str,
        /// Value given.
        value: f64,
        /// The range it must lie in.
        wanted: &'static str,
    },
    /// Two surfaces carry one name.
    #[error("surface {name:?} is defined twice")]
    DuplicateSurface {
        /// The name.
        name: String,
    },
    /// A ray without direction.
    #[error("the ray has no direction")]
    ZeroDirection,
    /// A surface id of another scene.
    #[error("surface {index}, but the scene has {count}")]
    UnknownSurface {
        /// The id given.
        index: usize,
        /// Surfaces of the scene.
        count: usize,
    },
    /// An opening was asked of a surface that does not move.
    #[error("surface {surface:?} does not move")]
    NotMovable {
        /// Surface.
        surface: String,
    },
    /// An opening outside the range of its door or panel.
    #[error("surface {surface:?}: opening {value} outside [{min}, {max}]")]
    OpeningOutOfRange {
        /// Surface.
        surface: String,
        /// Opening given, rad or m.
        value: f64,
        /// Lower end, rad or m.
        min: f64,
        /// Upper end, rad or m.
        max: f64,
    },
}

impl SceneError {
    /// With the name of the file in front: of the sidecar, if there is one and the error is about what only a sidecar says,
    /// else of the OBJ.
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

    /// With the name of the file in front, unless it is named already.
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

/// Rejects NaN and infinity in a vector, naming the argument.
pub(crate) fn finite(what: &'static str, v: DVec3) -> Result<DVec3, ArgumentError> {
    all_finite(what, &v.to_array())?;
    Ok(v)
}
