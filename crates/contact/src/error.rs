//! The one error type of the crate.

use hwall_hand::HandError;
use hwall_numeric::ArgumentError;

/// What can be wrong with training reaches, a model file or a configuration.
///
/// A hand that is about to touch nothing is not an error: see [`Predictor`](crate::Predictor).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContactError {
    /// An argument is not finite or outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A labelled reach cannot be learnt from, or a setting of a filter is out of range.
    #[error(transparent)]
    Hand(#[from] HandError),
    /// A file cannot be read or written.
    #[error("{path}: {message}")]
    Io {
        /// The file, or `(stream)`.
        path: String,
        /// Which kind of failure it is.
        kind: std::io::ErrorKind,
        /// The message of the operating system.
        message: String,
    },
    /// There are too few reaches to learn from.
    #[error("{got} reaches, at least {needed} are needed")]
    TooFewReaches {
        /// How many there are.
        got: usize,
        /// How many there must be.
        needed: usize,
    },
    /// The normal equations of a regression are singular or not finite.
    #[error("normal equations of size {size} cannot be solved")]
    Singular {
        /// Number of coefficients.
        size: usize,
    },
    /// The interaction primitive cannot be trained, read or run.
    #[error(transparent)]
    Primitive(#[from] hwall_bip::BipError),
    /// The file is not a model file of this crate.
    #[error("the file is of the format {found:?}, not {expected:?}")]
    FileFormat {
        /// The format read here.
        expected: &'static str,
        /// The format the file names.
        found: String,
    },
    /// The file has a newer version.
    #[error("the file has version {found}, the newest that can be read is {newest}")]
    FileVersion {
        /// Newest version read here.
        newest: u64,
        /// Version of the file.
        found: u64,
    },
    /// The file ends in the middle.
    #[error("the file ends too early, at line {line}, column {column}")]
    FileTruncated {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
    },
    /// The file is not JSON.
    #[error("not JSON at line {line}, column {column}")]
    FileSyntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
    },
    /// A field is missing, unknown or of another type.
    #[error("not a model at line {line}, column {column}: {problem}")]
    FileContents {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The field and what is wrong with it, in the words of the JSON reader.
        problem: String,
    },
    /// The contents are not those that were written.
    #[error("the file was changed: its digest is {computed}, it says {stored}")]
    FileDigest {
        /// Digest in the file.
        stored: String,
        /// Digest of its contents.
        computed: String,
    },
    /// A list has another length than the rest of the file requires.
    #[error("{what} has {got} entries, it must have {expected}")]
    FileLength {
        /// Name of the list.
        what: &'static str,
        /// Entries it must have.
        expected: usize,
        /// Entries it has.
        got: usize,
    },
}
