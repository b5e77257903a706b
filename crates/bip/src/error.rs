//! The one error type of the crate.

/// What can be wrong with a demonstration, a configuration or an observation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BipError {
    /// A sample of a demonstration is NaN or infinite.
    #[error("row {row}, column {column} is {value}, not a finite number")]
    NonFiniteSample {
        /// Sample, from 0.
        row: usize,
        /// Degree of freedom, from 0.
        column: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// An argument holds NaN or an infinity.
    #[error("{what}[{index}] is {value}, not a finite number")]
    NonFinite {
        /// The argument.
        what: &'static str,
        /// Its place in the argument.
        index: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// Time stands still or runs backwards between two samples.
    #[error("row {row}: time {time} does not follow {previous}")]
    TimeNotIncreasing {
        /// The later sample, from 0.
        row: usize,
        /// Its time stamp.
        time: f64,
        /// Time stamp of the sample before.
        previous: f64,
    },
    /// A demonstration has fewer than two samples, so no duration.
    #[error("{samples} samples make no demonstration, two are needed")]
    TooShort {
        /// Samples given.
        samples: usize,
    },
    /// An argument has the wrong length.
    #[error("{what} has {got} values, {expected} are expected")]
    WrongLength {
        /// The argument.
        what: &'static str,
        /// Length expected.
        expected: usize,
        /// Length given.
        got: usize,
    },
    /// A demonstration has another number of degrees of freedom than the groups of the model.
    #[error(
        "demonstration {demonstration} has {got} degrees of freedom, the groups have {expected}"
    )]
    DofMismatch {
        /// Demonstration, from 0.
        demonstration: usize,
        /// Degrees of freedom of all groups.
        expected: usize,
        /// Degrees of freedom of the demonstration.
        got: usize,
    },
    /// Fewer demonstrations than a request needs.
    #[error("{got} demonstrations, {needed} are needed")]
    TooFewDemonstrations {
        /// Demonstrations needed.
        needed: usize,
        /// Demonstrations there are.
        got: usize,
    },
    /// The degrees of freedom of an onset stay where they are, or move no faster than their noise.
    #[error("nothing moves: peak speed {peak_speed}, noise reaches {noise_speed}")]
    NothingMoves {
        /// Largest smoothed speed, in the unit of the degrees of freedom per unit of time.
        peak_speed: f64,
        /// Speed that noise alone hardly ever has.
        noise_speed: f64,
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
    /// A demonstration that the trainer does not hold, or no longer.
    #[error("no demonstration with number {id}")]
    UnknownDemonstration {
        /// Its number: how many were added before it.
        id: u64,
    },
    /// A degree of freedom that the model does not have.
    #[error("degree of freedom {dof} of {dofs}")]
    UnknownDof {
        /// Index given, from 0.
        dof: usize,
        /// Degrees of freedom of the model.
        dofs: usize,
    },
    /// A degree of freedom is listed twice in one observation.
    #[error("degree of freedom {dof} is listed twice")]
    DuplicateDof {
        /// The index, from 0.
        dof: usize,
    },
    /// A covariance is not positive definite.
    #[error("{what} is not positive definite: pivot {pivot} is {value}")]
    NotPositiveDefinite {
        /// The matrix.
        what: &'static str,
        /// Row of the first bad pivot, from 0.
        pivot: usize,
        /// The pivot.
        value: f64,
    },
    /// A basis function or its weight is too large for a double at this phase.
    #[error("overflow at phase {phase}")]
    Overflow {
        /// The phase.
        phase: f64,
    },
    /// Reading or writing a file failed.
    #[error("file: {kind}")]
    Io {
        /// What the system says.
        kind: std::io::ErrorKind,
    },
    /// The file is something else.
    #[error("the file says it is {found:?}, not {expected:?}")]
    FileFormat {
        /// What a model file says.
        expected: &'static str,
        /// What this one says.
        found: String,
    },
    /// The file is of a version that this crate does not know.
    #[error("the file has version {found}, the newest one known is {newest}")]
    FileVersion {
        /// Newest version that can be read; the oldest is 1.
        newest: u64,
        /// Version of the file.
        found: u64,
    },
    /// The file ends before the model does.
    #[error("the file ends too early, at line {line}, column {column}")]
    FileTruncated {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
    },
    /// The file is no JSON.
    #[error("no JSON at line {line}, column {column}")]
    FileSyntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
    },
    /// A field of the file is missing, unknown or of another type.
    #[error("the file has no model at line {line}, column {column}: {problem}")]
    FileContents {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The field and what is wrong with it, in the words of the JSON reader.
        problem: String,
    },
    /// The numbers of the file are not those that were written.
    #[error("the file was changed: its digest is {computed}, it says {stored}")]
    FileDigest {
        /// Digest in the file.
        stored: String,
        /// Digest of its numbers.
        computed: String,
    },
    /// The functions stored for a basis are not orthonormal ones of that basis.
    #[error("the stored functions of a basis are {deviation} from orthonormal")]
    FileBasis {
        /// Largest entry of the difference of their products from the identity.
        deviation: f64,
    },
    /// A singular value decomposition did not converge.
    #[error("the singular values of a {rows} x {columns} matrix did not converge")]
    NotConverged {
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        columns: usize,
    },
}

/// Rejects NaN and infinities, naming the argument and the place.
pub(crate) fn finite(what: &'static str, values: &[f64]) -> Result<(), BipError> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(BipError::NonFinite {
            what,
            index,
            value: values[index],
        }),
    }
}

/// Rejects another length than the expected one.
pub(crate) fn length(what: &'static str, expected: usize, got: usize) -> Result<(), BipError> {
    if expected == got {
        Ok(())
    } else {
        Err(BipError::WrongLength {
            what,
            expected,
            got,
        })
    }
}

/// Rejects a number that is not finite and positive.
pub(crate) fn positive(what: &'static str, value: f64) -> Result<(), BipError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(BipError::Parameter {
            what,
            value,
            wanted: "finite and positive",
        })
    }
}

/// Rejects a number that is not finite and at least zero.
pub(crate) fn not_negative(what: &'static str, value: f64) -> Result<(), BipError> {
    if value.is_finite() && value >= 0.0 {
        Ok(())
    } else {
        Err(BipError::Parameter {
            what,
            value,
            wanted: "finite and not negative",
        })
    }
}

/// Rejects a number outside `[0, 1]`.
pub(crate) fn share(what: &'static str, value: f64) -> Result<(), BipError> {
    if (0.0..=1.0).contains(&value) {
        Ok(())
    } else {
        Err(BipError::Parameter {
            what,
            value,
            wanted: "between 0 and 1",
        })
    }
}
