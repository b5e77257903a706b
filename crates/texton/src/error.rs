//! The one error type of the crate.

use hwall_files::TableError;
use hwall_numeric::ArgumentError;
use std::fmt::Display;
use std::io::ErrorKind;
use std::path::Path;

/// Errors of textures, patches, models, files and arguments.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TextonError {
    /// An argument is NaN or outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A pair with a level beyond the list, or with one level twice.
    #[error("pair {pair:?} of {levels} levels")]
    BadPair {
        /// Places of the two levels.
        pair: [usize; 2],
        /// How many there are.
        levels: usize,
    },
    /// A text is no table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A cell of a table that is not a number in its range.
    #[error("line {line}: {column} is \"{text}\", not a number in its range")]
    Cell {
        /// The line, from 1.
        line: u64,
        /// Name of the column.
        column: &'static str,
        /// Text of the cell.
        text: String,
    },
    /// An image with the wrong number of pixels.
    #[error("{values} pixels for an image of {width} x {height}")]
    MapSize {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Pixels.
        values: usize,
    },
    /// A table without a column.
    #[error("column {column} is missing")]
    MissingColumn {
        /// Its name.
        column: &'static str,
    },
    /// Conditions of a calibration that do not span an area of orientation and speed.
    #[error("{nodes} conditions do not span an area of orientation and speed")]
    NoArea {
        /// How many there are.
        nodes: usize,
    },
    /// Conditions of a calibration that do not form a full grid.
    #[error(
        "{nodes} conditions do not form a grid of {orientations} orientations and {speeds} speeds"
    )]
    NoGrid {
        /// Different orientations.
        orientations: usize,
        /// Different speeds.
        speeds: usize,
        /// Conditions.
        nodes: usize,
    },
    /// A magnitude that does not occur.
    #[error("magnitude {wanted} does not occur, only {min} to {max}")]
    NotAttained {
        /// The magnitude.
        wanted: f64,
        /// The least that occurs.
        min: f64,
        /// The greatest that occurs.
        max: f64,
    },
    /// A condition outside the calibrated ones.
    #[error("{orientation_deg} degrees at {speed_mm_per_s} mm/s is outside the calibration")]
    OutsideCalibration {
        /// Orientation, degrees.
        orientation_deg: f64,
        /// Speed, mm/s.
        speed_mm_per_s: f64,
    },
    /// Neighbouring bumps overlap.
    #[error(
        "bumps overlap: those {columns} columns and {rows} rows apart are {distance} radii apart, fewer than 2"
    )]
    Overlap {
        /// Columns between the two.
        columns: i64,
        /// Rows between the two.
        rows: i64,
        /// Distance of their centres after bumps are scaled to unit circles; bumps touch at 2.
        distance: f64,
    },
    /// No bump of the texture fits on the patch.
    #[error("no bump fits on a patch of {width_mm} x {length_mm} mm")]
    NoBumps {
        /// Size of the patch along the long axis, mm.
        width_mm: f64,
        /// Its size along the short axis, mm.
        length_mm: f64,
    },
    /// A mounting hole that is not within one tile, or overlaps another hole.
    #[error("mounting hole {index} crosses a border or overlaps another hole")]
    Hole {
        /// Which of the holes.
        index: usize,
    },
    /// Bumps too close for a surface between them.
    #[error("bumps are {gap_mm} mm apart, a mesh needs more than {least_mm} mm between them")]
    Touching {
        /// The gap between neighbours, mm.
        gap_mm: f64,
        /// Least gap for this mesh, mm.
        least_mm: f64,
    },
    /// A mesh with more triangles than allowed.
    #[error("{triangles} triangles, allowed: {limit}")]
    TooManyTriangles {
        /// How many it would have; a lower bound where counting takes too long.
        triangles: u64,
        /// How many are allowed.
        limit: u64,
    },
    /// Outlines on the plate that cross or coincide.
    #[error("the plate cannot be triangulated: {conflicts} outlines cross, or points coincide")]
    Triangulation {
        /// How many edges cross others.
        conflicts: usize,
    },
    /// A triangle with an index beyond the points.
    #[error("triangle with point {index}, but there are {points}")]
    MissingPoint {
        /// The index.
        index: u32,
        /// Number of points.
        points: usize,
    },
    /// Points or triangles that coincide or vanish in the single precision of STL.
    #[error("{count} points or triangles vanish in single precision")]
    SinglePrecision {
        /// How many.
        count: usize,
    },
    /// A file that cannot be opened, read or written.
    #[error("{name}: {message}")]
    File {
        /// The file, or what was read.
        name: String,
        /// What kind of failure it is; `InvalidData` for a file of another format.
        kind: ErrorKind,
        /// Message of the system or the decoder.
        message: String,
    },
    /// A picture without the channel asked for.
    #[error("there is no channel {wanted}, only: {found}")]
    Channel {
        /// The channel.
        wanted: String,
        /// Those of the picture.
        found: String,
    },
    /// An attribute that is neither stated in the picture nor given.
    #[error("the {name} is neither stated in the picture nor given")]
    Attribute {
        /// The attribute.
        name: &'static str,
    },
    /// A pixel that is not finite.
    #[error("pixel {column}, {row} from the top left is {value}")]
    Pixel {
        /// Column, from the left.
        column: usize,
        /// Row, from the top: that of the largest y or v.
        row: usize,
        /// Its value.
        value: f64,
    },
    /// Ratios of roughness that no texture within the limits presents.
    #[error(
        "a ratio of {wanted:.4} between roughest and smoothest is out of reach, the nearest that is possible is {nearest:.4}"
    )]
    RatioTooWide {
        /// Roughest to smoothest, wanted.
        wanted: f64,
        /// The largest ratio that is possible.
        nearest: f64,
    },
    /// Levels that lie within what textures reach, but in gaps of what is predicted, or whose errors are not known.
    #[error(
        "no texture within the limits has all of the {asked} levels: they lie in gaps of what is predicted"
    )]
    NoSuchLevels {
        /// Levels wanted.
        asked: usize,
    },
    /// A magnitude that no texture within the limits presents together with the others.
    #[error("magnitude {wanted:.4} is out of reach, the nearest that is possible is {nearest:.4}")]
    MagnitudeOutOfReach {
        /// The magnitude wanted.
        wanted: f64,
        /// The nearest one of the design that misses least.
        nearest: f64,
    },
    /// A texture that the printer cannot make.
    #[error("the {what} is {is_mm:.4} mm, the printer needs at least {needs_mm:.4} mm")]
    NotPrintable {
        /// What is too small.
        what: &'static str,
        /// Its size, mm.
        is_mm: f64,
        /// The nearest that is possible, mm.
        needs_mm: f64,
    },
    /// Fewer levels than wanted, or none wanted.
    #[error("{wanted} levels wanted, there are {levels}")]
    TooFewLevels {
        /// How many are wanted.
        wanted: usize,
        /// How many there are.
        levels: usize,
    },
}

impl TextonError {
    /// The system's failure at a file.
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
