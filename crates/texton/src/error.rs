//! The one error type of the crate.

/// What can be wrong with a texture, a patch, a model, a file or a question.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TextonError {
    /// A parameter is NaN or outside its range.
    #[error("{what} is {value}, wanted: {wanted}")]
    Parameter {
        /// The parameter, with its unit.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        wanted: &'static str,
    },
    /// A pair names a level that there is not, or one level twice.
    #[error("pair {pair:?} of {levels} levels")]
    BadPair {
        /// Places of the two levels.
        pair: [usize; 2],
        /// How many there are.
        levels: usize,
    },
    /// A line of a table has the wrong number of cells or is no text.
    #[error("line {line} cannot be read")]
    BrokenLine {
        /// The line, from 1; 0 if unknown.
        line: u64,
    },
    /// A cell of a table is no number in its range.
    #[error("line {line}: {column} is \"{text}\", wanted: a number in its range")]
    Cell {
        /// The line, from 1.
        line: u64,
        /// Name of the column.
        column: &'static str,
        /// What stands there.
        text: String,
    },
    /// An image has the wrong number of pixels.
    #[error("{values} pixels for an image of {width} x {height}")]
    MapSize {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Pixels.
        values: usize,
    },
    /// A table lacks a column.
    #[error("column {column} is missing")]
    MissingColumn {
        /// Its name.
        column: &'static str,
    },
    /// The conditions of a calibration do not span an area of orientation and speed.
    #[error("{nodes} conditions that span no area of orientation and speed")]
    NoArea {
        /// How many there are.
        nodes: usize,
    },
    /// The conditions of a calibration are no full grid.
    #[error("{nodes} conditions are no grid of {orientations} orientations and {speeds} speeds")]
    NoGrid {
        /// Different orientations.
        orientations: usize,
        /// Different speeds.
        speeds: usize,
        /// Conditions.
        nodes: usize,
    },
    /// A magnitude is not attained.
    #[error("magnitude {wanted} is not attained, wanted: {min} to {max}")]
    NotAttained {
        /// The magnitude.
        wanted: f64,
        /// The least that is.
        min: f64,
        /// The largest that is.
        max: f64,
    },
    /// A condition lies outside the calibrated ones.
    #[error("{orientation_deg} degrees at {speed_mm_per_s} mm/s is outside the calibration")]
    OutsideCalibration {
        /// Orientation, degrees.
        orientation_deg: f64,
        /// Speed, mm/s.
        speed_mm_per_s: f64,
    },
    /// Neighbouring bumps overlap.
    #[error(
        "bumps overlap: those {columns} columns and {rows} rows apart are {distance} radii apart, wanted: 2"
    )]
    Overlap {
        /// Columns between the two.
        columns: i64,
        /// Rows between the two.
        rows: i64,
        /// Distance of their centres where the bumps are scaled to unit circles; 2 is touching.
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
    /// A mounting hole that is not within one tile, or meets another hole.
    #[error("mounting hole {index} crosses a border or another hole")]
    Hole {
        /// Which of the holes.
        index: usize,
    },
    /// Bumps too close for the plate between them to be a surface.
    #[error("bumps are {gap_mm} mm apart, a mesh needs more than {least_mm} mm between them")]
    Touching {
        /// The gap between neighbours, mm.
        gap_mm: f64,
        /// What the mesh asked for needs, mm.
        least_mm: f64,
    },
    /// A mesh larger than was allowed.
    #[error("{triangles} triangles, allowed: {limit}")]
    TooManyTriangles {
        /// How many it would have; a lower bound where counting them all takes too long.
        triangles: u64,
        /// How many may be.
        limit: u64,
    },
    /// Outlines on the plate that cross or coincide.
    #[error("the plate cannot be triangulated: {conflicts} outlines cross, or points coincide")]
    Triangulation {
        /// How many edges were in the way of others.
        conflicts: usize,
    },
    /// A triangle refers to a point that is not there.
    #[error("triangle with point {index} of {points}")]
    MissingPoint {
        /// The index.
        index: u32,
        /// Number of points.
        points: usize,
    },
    /// Points or triangles that are apart in double precision and not in the single precision of STL.
    #[error("{count} points or triangles vanish in single precision")]
    SinglePrecision {
        /// How many.
        count: usize,
    },
    /// A file that cannot be opened, read or written.
    #[error("{name}: {message}")]
    File {
        /// The file, or what was done to it.
        name: String,
        /// What the system or the decoder says.
        message: String,
    },
    /// A picture without the channel asked for.
    #[error("no channel {wanted}; there are: {found}")]
    Channel {
        /// The channel.
        wanted: String,
        /// Those of the picture.
        found: String,
    },
    /// A picture that does not say what was not given either.
    #[error("the picture does not say its {name}, and none was given")]
    Attribute {
        /// The attribute.
        name: &'static str,
    },
    /// A pixel that is no finite number.
    #[error("pixel {column}, {row} from the top left is {value}")]
    Pixel {
        /// Column, from the left.
        column: usize,
        /// Row, from the top: that of the largest y or v.
        row: usize,
        /// Its value.
        value: f64,
    },
    /// There are fewer levels than wanted, or nothing is wanted.
    #[error("{wanted} levels wanted of {levels}")]
    TooFewLevels {
        /// How many are wanted.
        wanted: usize,
        /// How many there are.
        levels: usize,
    },
}

/// Rejects what is not a positive number.
pub(crate) fn positive(what: &'static str, value: f64) -> Result<(), TextonError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    let wanted = "a positive number";
    Err(TextonError::Parameter {
        what,
        value,
        wanted,
    })
}

/// Rejects NaN and infinity.
pub(crate) fn finite(what: &'static str, value: f64) -> Result<(), TextonError> {
    if value.is_finite() {
        return Ok(());
    }
    let wanted = "a finite number";
    Err(TextonError::Parameter {
        what,
        value,
        wanted,
    })
}
