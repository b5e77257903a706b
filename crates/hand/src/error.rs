//! The one error type of the crate.

use hwall_files::TableError;
use hwall_geometry::GeometryError;
use hwall_numeric::ArgumentError;

/// Errors in recordings, labelled reaches, point pairs or configurations.
///
/// A lost hand is not an error: see [`Tracking`](crate::Tracking).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HandError {
    /// An argument is not finite or outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// The fitted transform is not finite: the points are too far away.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// The text is not a table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A file cannot be read or written.
    #[error("{path}: {message}")]
    Io {
        /// The file, or `(stream)`.
        path: String,
        /// Kind of failure.
        kind: std::io::ErrorKind,
        /// Message of the operating system or of the CSV library.
        message: String,
    },
    /// The CSV has a header without rows, or a recording has no sample.
    #[error("no samples below the header line")]
    NoSamples,
    /// A required column is missing: `t`, or a coordinate of a point with other coordinates.
    #[error("no column {column:?}")]
    MissingColumn {
        /// Name of the missing column.
        column: String,
    },
    /// Two columns have the same name.
    #[error("column {column:?} appears twice")]
    DuplicateColumn {
        /// The name.
        column: String,
    },
    /// No column holds a point of the hand.
    #[error("no point of the hand among the columns")]
    NoHandColumns,
    /// A cell is not a number.
    #[error("line {line}, column {column:?}: {text:?} is not a number")]
    NotANumber {
        /// Line of the file; the header is line 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// The cell, cut to 40 characters.
        text: String,
    },
    /// A cell is infinite, or a number in memory is not finite.
    #[error("line {line}, column {column:?}: {value} is not a finite number")]
    NonFiniteCell {
        /// Line of the file, the header being line 1; for recordings in memory, the sample from 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// NaN or an infinity.
        value: f64,
    },
    /// A point has one coordinate but lacks another, or a row has no time.
    #[error("line {line}, column {column:?}: empty")]
    MissingCell {
        /// Line of the file; the header is line 1.
        line: u64,
        /// Name of the empty column.
        column: String,
    },
    /// A gaze vector is too short to have a direction.
    #[error("line {line}: gaze of length {length}")]
    ZeroGaze {
        /// Line of the file; the header is line 1.
        line: u64,
        /// Its length.
        length: f64,
    },
    /// Time does not increase within one trial.
    #[error("line {line}: time {t_s} s does not follow {previous_s} s")]
    TimeNotIncreasing {
        /// Line of the file, the header being line 1; for recordings in memory, the sample from 1.
        line: u64,
        /// Time of the sample, s.
        t_s: f64,
        /// Time of the sample before, s.
        previous_s: f64,
    },
    /// A file holds several trials where one is expected.
    #[error("{count} trials in a file of which one was expected")]
    SeveralTrials {
        /// Trials found.
        count: usize,
    },
    /// A reach is unusable for training or evaluation.
    #[error("reach {reach}: {what}")]
    Reach {
        /// Person and trial.
        reach: String,
        /// What is wrong.
        what: &'static str,
    },
    /// There are more bystanders than a frame holds.
    #[error("{count} bystanders, at most {most} count: send the nearest ones")]
    TooManyBystanders {
        /// How many there are.
        count: usize,
        /// How many may be.
        most: usize,
    },
    /// There are fewer point pairs than a rigid transform needs.
    #[error("{got} point pairs, {needed} are needed")]
    TooFewPairs {
        /// Pairs needed.
        needed: usize,
        /// Pairs given.
        got: usize,
    },
    /// The points lie above each other or coincide, so the heading is undetermined.
    #[error("the points lie above each other: {ratio} of their extent fixes the heading")]
    Collinear {
        /// Extent that determines the rotation, as a share of the extent of the points.
        ratio: f64,
    },
}
