//! The one error type of the crate.

use hwall_files::TableError;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::that;
use std::io::ErrorKind;

/// Errors of files, studies, designs and arguments.
///
/// Lines count from 1 with the header as line 1, as editors show them.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what the fields hold")]
pub enum PsychophysicsError {
    /// An argument is NaN or outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A file that cannot be opened, read or written.
    #[error("{name}: {message}")]
    File {
        name: String,
        kind: ErrorKind,
        message: String,
    },
    /// A text is not a table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A validity cell that is neither true nor false.
    #[error("line {line}, column {column:?}: {text:?} is neither true nor false")]
    NeitherValidNorNot {
        line: u64,
        column: String,
        text: String,
    },
    /// No row of the table is valid.
    #[error("none of the {rows} rows is valid")]
    NoValidRows { rows: usize },
    /// A wide table that cannot be read.
    #[error("no wide table: {why}")]
    Wide { why: &'static str },
    /// A column that is not in the header.
    #[error("no column {column:?} in the header {header:?}")]
    UnknownColumn { column: String, header: String },
    /// A name that occurs for several columns of the header.
    #[error("column {column:?} occurs {count} times in the header")]
    AmbiguousColumn { column: String, count: usize },
    /// A column that is given two roles.
    #[error("column {column:?} is named twice")]
    ColumnTwice { column: String },
    /// An empty cell instead of a subject, level or round.
    #[error("line {line}, column {column:?} is empty")]
    EmptyCell { line: u64, column: String },
    /// A value that is not a finite number: empty, `NaN`, `NA`, a decimal comma.
    #[error("line {line}, column {column:?}: {text:?} is not a finite number")]
    NotANumber {
        line: u64,
        column: String,
        text: String,
    },
    /// Values whose squares or fourth powers overflow or underflow a float. `line` counts values from 1 if the study was not
    /// read from a table.
    #[error(
        "line {line}: the largest size is {value:e}, it must be zero or 1e-60 to 1e60; choose another unit"
    )]
    Scale { line: u64, value: f64 },
    /// Two values for the same subject, cell and round; `rounds` says whether the study has a round column.
    #[error(
        "line {line}: subject {subject:?} already has a value for {cell} on line {first_line}{}",
        if *rounds { "" } else { "; repeated trials need a round column" }
    )]
    Duplicate {
        line: u64,
        first_line: u64,
        subject: String,
        cell: String,
        rounds: bool,
    },
    /// Combinations of subject, levels and round without a value.
    #[error("subject {subject:?} has no value for {cell}{}", more(*missing))]
    MissingCell {
        subject: String,
        cell: String,
        missing: usize,
    },
    /// A subject appears in two groups of the factor between subjects.
    #[error(
        "line {line}: subject {subject:?} is in {group:?} and on line {first_line} in another {factor:?}"
    )]
    SubjectInTwoGroups {
        line: u64,
        first_line: u64,
        subject: String,
        factor: String,
        group: String,
    },
    /// The table has a header only, or a study has no values.
    #[error("no values")]
    NoRows,
    /// Too few subjects to estimate an error.
    #[error("subjects in the study or its smallest group: {got}, it needs at least {wanted}")]
    TooFewSubjects { got: usize, wanted: usize },
    /// A factor that does not vary.
    #[error("factor {factor:?} has only the level {level:?}, it needs two or more")]
    OneLevel { factor: String, level: String },
    /// Two factors of the same name.
    #[error("two factors have the name {factor:?}")]
    FactorTwice { factor: String },
    /// No factor, or more than are supported.
    #[error("{got} factors within subjects, it must be 1 to {most}")]
    FactorCount { got: usize, most: usize },
    /// A factor that the study does not have.
    #[error("the study has no factor {factor:?}")]
    UnknownFactor { factor: String },
    /// All values are the same: there is no variance to analyse.
    #[error("all {count} values are {value}")]
    Constant { count: usize, value: f64 },
    /// A negative (or zero) answer although ratios or logarithms are needed; `line` as for [`Scale`](Self::Scale).
    #[error("line {line}: subject {subject:?}, {cell}: {value} is not {wanted}")]
    NotPositive {
        line: u64,
        subject: String,
        cell: String,
        value: f64,
        wanted: &'static str,
    },
    /// A subject whose answers are all zero, which cannot be scaled.
    #[error("subject {subject:?} has the mean {mean}, it must be above zero")]
    SubjectMean { subject: String, mean: f64 },
    /// Groups of different size, which aligned ranks do not allow.
    #[error("groups of {smallest} and of {largest} subjects, they must be equal")]
    UnequalGroups { smallest: usize, largest: usize },
    /// A list of the wrong length.
    #[error("{what}: {got}, it must be {wanted}")]
    Length {
        what: &'static str,
        got: usize,
        wanted: usize,
    },
    /// A factor of a session script with the name of another column.
    #[error(
        "factor {factor:?} has the name of another column; subject, round, trial and condition are reserved"
    )]
    ColumnTaken { factor: String },
    /// A sphericity correction for pooled errors, which have no sphericity of their own.
    #[error("Greenhouse and Geisser's correction is for strata, not for pooled errors")]
    PooledCorrection,
    /// A fit that did not converge.
    #[error("the fit has not converged after {steps} steps")]
    NotConverged { steps: usize },
    /// Data without a finite fit.
    #[error("no fit: {why}")]
    NoFit { why: &'static str },
}

fn more(missing: usize) -> String {
    match missing.saturating_sub(1) {
        0 => String::new(),
        1 => ", and 1 more value is missing".to_owned(),
        n => format!(", and {n} more values are missing"),
    }
}

impl PsychophysicsError {
    /// An I/O error at a file or stream of this name.
    pub(crate) fn io(name: impl Into<String>, error: &std::io::Error) -> Self {
        Self::File {
            name: name.into(),
            kind: error.kind(),
            message: error.to_string(),
        }
    }
}

/// Accepts a probability strictly between 0 and 1.
pub(crate) fn inner_probability(what: &'static str, value: f64) -> Result<f64, ArgumentError> {
    // Nearer to the ends quantiles lose their digits.
    let holds = (1e-9..=1.0 - 1e-9).contains(&value);
    that(holds, what, value, "between 1e-9 and 1 - 1e-9")
}

/// Result with the error of this crate.
pub(crate) type Result<T, E = PsychophysicsError> = std::result::Result<T, E>;
