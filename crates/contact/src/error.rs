//! The one error type of the crate.

/// What can be wrong with a recording, a calibration or a configuration.
///
/// A hand that is lost, or a hand that is about to touch nothing, is no error: see
/// [`Tracking`](crate::Tracking) and [`Predictor`](crate::Predictor).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContactError {
    /// A file cannot be read or written.
    #[error("{path}: {message}")]
    Io {
        /// The file, or `(stream)`.
        path: String,
        /// What the system said.
        message: String,
    },
    /// The CSV holds no header line.
    #[error("empty: no header line")]
    Empty,
    /// The CSV holds a header and nothing below it.
    #[error("no samples below the header line")]
    NoSamples,
    /// A reach that nothing can be learnt from or judged by.
    #[error("reach {reach}: {what}")]
    Reach {
        /// Person and trial.
        reach: String,
        /// What is wrong with it.
        what: &'static str,
    },
    /// Too few reaches to learn from.
    #[error("{got} reaches, at least {needed} are needed")]
    TooFewReaches {
        /// How many there are.
        got: usize,
        /// How many there must be.
        needed: usize,
    },
    /// A regression whose normal equations are singular or hold numbers that are not finite.
    #[error("normal equations of size {size} cannot be solved")]
    Singular {
        /// Number of coefficients.
        size: usize,
    },
    /// The interaction primitive cannot be trained or run.
    #[error(transparent)]
    Primitive(#[from] hwall_bip::BipError),
    /// A model file of something else.
    #[error("the file is of the format {found:?}, not {expected:?}")]
    FileFormat {
        /// The format read here.
        expected: &'static str,
        /// The format the file names.
        found: String,
    },
    /// A model file of a newer version.
    #[error("the file has version {found}, the newest that can be read is {newest}")]
    FileVersion {
        /// Newest version read here.
        newest: u64,
        /// Version of the file.
        found: u64,
    },
    /// A model file that ends in the middle.
    #[error("the file ends too early, at line {line}, column {column}")]
    FileTruncated {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
    },
    /// A model file that is no JSON.
    #[error("no JSON at line {line}, column {column}")]
    FileSyntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
    },
    /// A field of a model file is missing, unknown or of another type.
    #[error("the file has no model at line {line}, column {column}: {problem}")]
    FileContents {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The field and what is wrong with it, in the words of the JSON reader.
        problem: String,
    },
    /// The numbers of a model file are not those that were written.
    #[error("the file was changed: its digest is {computed}, it says {stored}")]
    FileDigest {
        /// Digest in the file.
        stored: String,
        /// Digest of its contents.
        computed: String,
    },
    /// A list of a model file has another length than the rest of it asks for.
    #[error("{what} has {got} entries, {expected} belong there")]
    FileLength {
        /// Name of the list.
        what: &'static str,
        /// Entries that belong there.
        expected: usize,
        /// Entries there are.
        got: usize,
    },
    /// A column that must be there is missing: `t`, or one coordinate of a point of which another is given.
    #[error("no column {column:?}")]
    MissingColumn {
        /// Name of the missing column.
        column: String,
    },
    /// A column that must be there is missing, and the header is one single column with a sign in it that
    /// separates columns elsewhere.
    #[error(
        "no column {column:?}: the header is one column that contains {separator:?}; columns must be separated by ','"
    )]
    Separator {
        /// Name of the missing column.
        column: String,
        /// The sign that seems to separate columns.
        separator: char,
    },
    /// Two columns carry the same name.
    #[error("column {column:?} appears twice")]
    DuplicateColumn {
        /// The name.
        column: String,
    },
    /// The header names no point of the hand at all.
    #[error("no point of the hand among the columns")]
    NoHandColumns,
    /// A row is longer or shorter than the header.
    #[error("line {line}: {got} cells, the header has {expected}")]
    CellCount {
        /// Line of the file, the header being line 1.
        line: u64,
        /// Cells of the header.
        expected: u64,
        /// Cells of the row.
        got: u64,
    },
    /// The text is no UTF-8.
    #[error("line {line}: not UTF-8")]
    NotUtf8 {
        /// Line of the file, the header being line 1.
        line: u64,
    },
    /// A cell is no number.
    #[error("line {line}, column {column:?}: {text:?} is not a number")]
    NotANumber {
        /// Line of the file, the header being line 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// The cell, cut to 40 characters.
        text: String,
    },
    /// A cell says NaN or infinity; a missing value is an empty cell.
    #[error("line {line}, column {column:?}: {value} is not a finite number")]
    NonFiniteCell {
        /// Line of the file, the header being line 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// NaN or an infinity.
        value: f64,
    },
    /// A point has one coordinate but lacks another, or a row lacks its time.
    #[error("line {line}, column {column:?}: empty")]
    MissingCell {
        /// Line of the file, the header being line 1.
        line: u64,
        /// Name of the empty column.
        column: String,
    },
    /// A gaze direction has no direction.
    #[error("line {line}: gaze of length {length}")]
    ZeroGaze {
        /// Line of the file, the header being line 1.
        line: u64,
        /// Its length.
        length: f64,
    },
    /// Time stands still or runs backwards inside one trial.
    #[error("line {line}: time {t_s} s does not follow {previous_s} s")]
    TimeNotIncreasing {
        /// Line of the file, the header being line 1; for recordings made in memory, the sample from 1.
        line: u64,
        /// Time of the sample, s.
        t_s: f64,
        /// Time of the sample before, s.
        previous_s: f64,
    },
    /// A file holds several trials where one was asked for.
    #[error("{count} trials in a file of which one was expected")]
    SeveralTrials {
        /// Trials found.
        count: usize,
    },
    /// A number is NaN or infinite.
    #[error("{what} is {value}, not a finite number")]
    NonFinite {
        /// The argument that holds it.
        what: &'static str,
        /// NaN or an infinity.
        value: f64,
    },
    /// Fewer point pairs than a rigid map needs.
    #[error("{got} point pairs, {needed} are needed")]
    TooFewPairs {
        /// Pairs needed.
        needed: usize,
        /// Pairs given.
        got: usize,
    },
    /// The points lie on one line or in one place: the turn about it is open.
    #[error("the points lie on one line: {ratio} of their extent fixes the turn about it")]
    Collinear {
        /// What fixes the turn beside the extent of the points.
        ratio: f64,
    },
    /// A map between frames does not keep lengths and handedness.
    #[error("not rigid: {deviation} away from a rotation")]
    NotRigid {
        /// Largest entry of `|RᵀR − 1|`, or 2 for a mirror.
        deviation: f64,
    },
    /// A parameter is outside its range.
    #[error("{what} is {value}, it must be {wanted}")]
    Parameter {
        /// Name of the parameter.
        what: &'static str,
        /// Value given.
        value: f64,
        /// The range it must lie in.
        wanted: &'static str,
    },
}

/// Rejects a parameter that is not finite and above zero.
pub(crate) fn positive(what: &'static str, value: f64) -> Result<(), ContactError> {
    let ok = value.is_finite() && value > 0.0;
    if ok {
        Ok(())
    } else {
        Err(ContactError::Parameter {
            what,
            value,
            wanted: "finite and positive",
        })
    }
}

/// Rejects a parameter that is not finite or below zero.
pub(crate) fn not_negative(what: &'static str, value: f64) -> Result<(), ContactError> {
    let ok = value.is_finite() && value >= 0.0;
    if ok {
        Ok(())
    } else {
        Err(ContactError::Parameter {
            what,
            value,
            wanted: "finite and not negative",
        })
    }
}
