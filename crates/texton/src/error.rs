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
    /// An image is not a readable OpenEXR file.
    #[error("no readable OpenEXR image: {reason}")]
    Exr {
        /// What the reader says.
        reason: String,
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
    /// An image of several channels has none that is known to be roughness.
    #[error("none of {channels} channels is named roughness, Y or R")]
    NoChannel {
        /// How many there are.
        channels: usize,
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
