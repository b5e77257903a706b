//! The one error type of the crate.

/// What can be wrong with a file, a study, a design or a question.
///
/// Lines count from 1 with the header as line 1, as editors show them.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PsychophysicsError {
    /// A file cannot be read.
    #[error("{path}: {message}")]
    Io {
        /// The file.
        path: String,
        /// What the system said.
        message: String,
    },
    /// The table is empty: no header line.
    #[error("no header line")]
    NoHeader,
    /// The header is not separated by commas.
    #[error("the header {header:?} is separated by {found:?}, wanted: commas")]
    Delimiter {
        /// The header line.
        header: String,
        /// What separates its cells.
        found: char,
    },
    /// A column that the study names is not in the header.
    #[error("no column {column:?} in the header {header:?}")]
    UnknownColumn {
        /// The column asked for.
        column: String,
        /// The header line.
        header: String,
    },
    /// A column name fits more than one column of the header.
    #[error("column {column:?} stands {count} times in the header")]
    AmbiguousColumn {
        /// The column asked for.
        column: String,
        /// Columns of that name.
        count: usize,
    },
    /// One column is given two roles.
    #[error("column {column:?} is named twice")]
    ColumnTwice {
        /// The column.
        column: String,
    },
    /// A line with too few or too many cells.
    #[error("line {line}: {got} cells, the header has {expected}")]
    CellCount {
        /// Where.
        line: u64,
        /// Cells of the line.
        got: u64,
        /// Cells of the header.
        expected: u64,
    },
    /// Text that is no UTF-8 or no CSV.
    #[error("line {line}: {message}")]
    Malformed {
        /// Where.
        line: u64,
        /// What the reader said.
        message: String,
    },
    /// An empty cell where a subject, level or round is wanted.
    #[error("line {line}, column {column:?} is empty")]
    EmptyCell {
        /// Where.
        line: u64,
        /// The column.
        column: String,
    },
    /// A value that is no finite number: empty, `NaN`, `NA`, a decimal comma.
    #[error("line {line}, column {column:?}: {text:?} is no finite number")]
    NotANumber {
        /// Where.
        line: u64,
        /// The column.
        column: String,
        /// The cell.
        text: String,
    },
    /// Values whose squares, or squares of those, a float cannot hold.
    #[error(
        "line {line}: the largest size is {value:e}, wanted: zero, or 1e-60 to 1e60; choose another unit"
    )]
    Scale {
        /// Where; the number of the value, from 1, for a study that was not read from a table.
        line: u64,
        /// The value.
        value: f64,
    },
    /// Two values for the same subject, cell and round.
    #[error(
        "line {line}: subject {subject:?} already has a value for {cell} on line {first_line}{}",
        if *rounds { "" } else { "; repeated trials need a round column" }
    )]
    Duplicate {
        /// The second of the two lines.
        line: u64,
        /// The first of the two lines.
        first_line: u64,
        /// The subject.
        subject: String,
        /// Levels and round.
        cell: String,
        /// Whether the study has a round column.
        rounds: bool,
    },
    /// Combinations of subject, levels and round without a value.
    #[error("subject {subject:?} has no value for {cell}{}", more(*missing))]
    MissingCell {
        /// The first subject concerned.
        subject: String,
        /// Levels and round of the first missing value.
        cell: String,
        /// Missing values in the whole study.
        missing: usize,
    },
    /// A subject appears in two groups of the factor between subjects.
    #[error(
        "line {line}: subject {subject:?} is in {group:?} and on line {first_line} in another {factor:?}"
    )]
    SubjectInTwoGroups {
        /// The second of the two lines.
        line: u64,
        /// The first of the two lines.
        first_line: u64,
        /// The subject.
        subject: String,
        /// The factor between subjects.
        factor: String,
        /// The group on the second line.
        group: String,
    },
    /// The table has a header only, or a study has no values.
    #[error("no values")]
    NoRows,
    /// Too few subjects to estimate an error.
    #[error("subjects in the study or its smallest group: {got}, wanted: at least {wanted}")]
    TooFewSubjects {
        /// Subjects of the study, or of its smallest group.
        got: usize,
        /// Fewest that work.
        wanted: usize,
    },
    /// A factor that does not vary.
    #[error("factor {factor:?} has the one level {level:?}, wanted: two or more")]
    OneLevel {
        /// The factor.
        factor: String,
        /// Its level.
        level: String,
    },
    /// Two factors of one name, which no question could tell apart.
    #[error("two factors have the name {factor:?}")]
    FactorTwice {
        /// The name.
        factor: String,
    },
    /// No factor, or more than the crate works with.
    #[error("{got} factors within subjects, wanted: 1 to {most}")]
    FactorCount {
        /// Factors named.
        got: usize,
        /// Most that are supported.
        most: usize,
    },
    /// A factor that the study does not have.
    #[error("the study has no factor {factor:?}")]
    UnknownFactor {
        /// The name asked for.
        factor: String,
    },
    /// All values are the same: there is no variance to analyse.
    #[error("all {count} values are {value}")]
    Constant {
        /// Number of values.
        count: usize,
        /// The one value.
        value: f64,
    },
    /// An estimate below zero (or zero) where ratios or logarithms are formed.
    #[error("line {line}: subject {subject:?}, {cell}: {value} is not {wanted}")]
    NotPositive {
        /// Where; the number of the value, from 1, for a study that was not read from a table.
        line: u64,
        /// The subject.
        subject: String,
        /// Its levels.
        cell: String,
        /// The estimate.
        value: f64,
        /// The range it must lie in.
        wanted: &'static str,
    },
    /// A subject whose estimates are all zero cannot be scaled.
    #[error("subject {subject:?} has the mean {mean}, wanted: above zero")]
    SubjectMean {
        /// The subject.
        subject: String,
        /// Mean of its estimates.
        mean: f64,
    },
    /// Aligned ranks need groups of the same size.
    #[error("groups of {smallest} and of {largest} subjects, wanted: equal groups")]
    UnequalGroups {
        /// Subjects of the smallest group.
        smallest: usize,
        /// Subjects of the largest group.
        largest: usize,
    },
    /// A parameter is NaN or outside its range.
    #[error("{what} is {value}, wanted: {wanted}")]
    Parameter {
        /// The parameter.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        wanted: &'static str,
    },
    /// An array has the wrong length.
    #[error("{what}: {got} values, wanted: {wanted}")]
    Length {
        /// The array.
        what: &'static str,
        /// Its length.
        got: usize,
        /// The length that fits.
        wanted: usize,
    },
    /// A factor of a session script that has the name of another of its columns.
    #[error(
        "factor {factor:?} has the name of another column; subject, round, trial and condition are taken"
    )]
    ColumnTaken {
        /// The factor.
        factor: String,
    },
    /// Pooled errors have no sphericity of their own to correct for.
    #[error("Greenhouse and Geisser's correction of pooled errors, wanted: strata")]
    PooledCorrection,
    /// A fit that was still moving when it was given up.
    #[error("no fit after {steps} steps: the last still moved it")]
    NotConverged {
        /// Steps taken.
        steps: usize,
    },
    /// Data from which a fit has no finite answer.
    #[error("no fit: {why}")]
    NoFit {
        /// What the data lack.
        why: &'static str,
    },
}

fn more(missing: usize) -> String {
    match missing.saturating_sub(1) {
        0 => String::new(),
        n => format!(", and {n} more values are missing"),
    }
}

/// Rejects NaN and whatever `holds` does not accept.
pub(crate) fn check(
    what: &'static str,
    value: f64,
    holds: bool,
    wanted: &'static str,
) -> Result<(), PsychophysicsError> {
    if holds && value.is_finite() {
        return Ok(());
    }
    Err(PsychophysicsError::Parameter {
        what,
        value,
        wanted,
    })
}
