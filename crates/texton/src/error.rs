//! The one error type of the crate.

use hwall_files::TableError;
use hwall_numeric::ArgumentError;
use std::fmt::Display;
use std::io::ErrorKind;
use std::path::Path;

/// Errors of textures, patches, models, files and arguments.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what the fields hold")]
pub enum TextonError {
    /// An argument is NaN or outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A pair with an index beyond the list of levels, or with the same level twice.
    #[error("pair {pair:?} of {levels} levels")]
    BadPair { pair: [usize; 2], levels: usize },
    /// A text is not a table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A cell of a table that is not a number in its range.
    #[error("line {line}: {column} is \"{text}\", not a number in its range")]
    Cell {
        line: u64,
        column: &'static str,
        text: String,
    },
    /// An image with the wrong number of pixels.
    #[error("{values} pixels for an image of {width} x {height}")]
    MapSize {
        width: usize,
        height: usize,
        values: usize,
    },
    /// A table without a column.
    #[error("column {column} is missing")]
    MissingColumn { column: &'static str },
    /// Conditions of a calibration that do not span an area of orientation and speed.
    #[error("{nodes} conditions do not span an area of orientation and speed")]
    NoArea { nodes: usize },
    /// No condition has the wanted magnitude.
    #[error("magnitude {wanted} does not occur, only {min} to {max}")]
    NotAttained { wanted: f64, min: f64, max: f64 },
    /// A condition outside the calibrated ones.
    #[error("{orientation_deg} degrees at {speed_mm_per_s} mm/s is outside the calibration")]
    OutsideCalibration {
        orientation_deg: f64,
        speed_mm_per_s: f64,
    },
    /// Neighbouring bumps overlap; `distance`: between their centres, with bumps scaled to unit circles.
    #[error(
        "bumps overlap: those {columns} columns and {rows} rows apart are {distance} radii apart, fewer than 2"
    )]
    Overlap {
        columns: i64,
        rows: i64,
        distance: f64,
    },
    /// No bump of the texture fits on the patch.
    #[error("no bump fits on a patch of {width_mm} x {length_mm} mm")]
    NoBumps { width_mm: f64, length_mm: f64 },
    /// A mounting hole that is not within one tile, or overlaps another hole.
    #[error("mounting hole {index} crosses a border or overlaps another hole")]
    Hole { index: usize },
    /// Bumps too close for a surface between them.
    #[error("bumps are {gap_mm} mm apart, a mesh needs more than {least_mm} mm between them")]
    Touching { gap_mm: f64, least_mm: f64 },
    /// A mesh with more triangles than allowed; `triangles` is a lower bound where counting takes too long.
    #[error("{triangles} triangles, allowed: {limit}")]
    TooManyTriangles { triangles: u64, limit: u64 },
    /// Outlines on the plate that cross or coincide.
    #[error("the plate cannot be triangulated: {conflicts} outlines cross, or points coincide")]
    Triangulation { conflicts: usize },
    /// A triangle with an index beyond the points.
    #[error("triangle with point {index}, but there are {points}")]
    MissingPoint { index: u32, points: usize },
    /// Points or triangles that coincide or vanish in the single precision of STL.
    #[error("{count} points or triangles vanish in single precision")]
    SinglePrecision { count: usize },
    /// A file that cannot be opened, read or written; of kind `InvalidData` if it has another format.
    #[error("{name}: {message}")]
    File {
        name: String,
        kind: ErrorKind,
        message: String,
    },
    /// A picture without the channel asked for.
    #[error("there is no channel {wanted}, only: {found}")]
    Channel { wanted: String, found: String },
    /// An attribute that is neither stated in the picture nor given.
    #[error("the {name} is neither stated in the picture nor given")]
    Attribute { name: &'static str },
    /// A pixel that is not finite; rows count from the top (largest y or v).
    #[error("pixel {column}, {row} from the top left is {value}")]
    Pixel {
        column: usize,
        row: usize,
        value: f64,
    },
    /// A picture without relief or contrast; `least`: the largest variation that its steps could hide.
    #[error(
        "the picture is uniform: its values vary by {rms:.1e}, and its steps could hide {least:.1e}"
    )]
    Uniform { rms: f64, least: f64 },
    /// A picture too coarse to resolve what a finger feels as texture.
    #[error(
        "the finest period that the picture resolves is {finest_mm:.2} mm, and a finger feels relief below {most_mm} mm as texture: take it from nearer"
    )]
    NotTactile { finest_mm: f64, most_mm: f64 },
    /// No texture within the limits presents the wanted ratios of roughness.
    #[error(
        "a ratio of {wanted:.4} between roughest and smoothest is out of reach, the nearest that is possible is {nearest:.4}"
    )]
    RatioTooWide { wanted: f64, nearest: f64 },
    /// Levels within the range of some texture, but in gaps of the prediction or without a known error.
    #[error(
        "no texture within the limits has all of the {asked} levels: they lie in gaps of what is predicted"
    )]
    NoSuchLevels { asked: usize },
    /// No texture within the limits presents this magnitude together with the others.
    #[error("magnitude {wanted:.4} is out of reach, the nearest that is possible is {nearest:.4}")]
    MagnitudeOutOfReach { wanted: f64, nearest: f64 },
    /// A texture that the printer cannot make.
    #[error("the {what} is {is_mm:.4} mm, the printer needs at least {needs_mm:.4} mm")]
    NotPrintable {
        what: &'static str,
        is_mm: f64,
        needs_mm: f64,
    },
    /// Fewer levels than wanted, or no level wanted.
    #[error("{wanted} levels wanted, there are {levels}")]
    TooFewLevels { wanted: usize, levels: usize },
}

impl TextonError {
    /// An I/O error of the system at a file.
    pub(crate) fn io(path: &Path, error: &std::io::Error) -> Self {
        Self::file(path.display(), error.kind(), error)
    }

    /// A failure at a file or stream of this name.
    pub(crate) fn file(name: impl Display, kind: ErrorKind, message: impl Display) -> Self {
        Self::File {
            name: name.to_string(),
            kind,
            message: message.to_string(),
        }
    }
}

/// Result with the error of this crate.
pub(crate) type Result<T, E = TextonError> = std::result::Result<T, E>;
