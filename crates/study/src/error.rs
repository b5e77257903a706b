//! The one error type of the crate.

use hwall::numeric::ArgumentError;
use std::io::ErrorKind;
use std::path::Path;

/// Errors of protocols, logs, presentations and reports.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// An argument is NaN or outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A file that cannot be opened, read or written.
    #[error("{name}: {message}")]
    File {
        /// The file.
        name: String,
        /// What kind of failure it is.
        kind: ErrorKind,
        /// Message of the system.
        message: String,
    },
    /// A new study where there is one.
    #[error("{name} holds a study already; resume it (--resume), or choose another folder")]
    Exists {
        /// The folder.
        name: String,
    },
    /// A line of the log that was changed after it was written.
    #[error(
        "line {line} of the log does not match its checksum, but lines follow it: the file was changed"
    )]
    Changed {
        /// The line, from 1.
        line: usize,
    },
    /// A log that does not begin with a protocol, or with one of another version.
    #[error("the log holds no study: {why}")]
    NoStudy {
        /// Why not.
        why: &'static str,
    },
    /// An event of the log that does not follow from those before it.
    #[error("event {event} of the log does not follow from those before it: {why}")]
    OutOfOrder {
        /// The event, from 1.
        event: usize,
        /// Why not.
        why: &'static str,
    },
    /// A factor that no presentation knows.
    #[error("factor {factor:?} cannot be presented, only angle, speed and surface")]
    UnknownFactor {
        /// The factor.
        factor: String,
    },
    /// A level that cannot be presented.
    #[error("level {level:?} of {factor} is not {wanted}")]
    BadLevel {
        /// The factor.
        factor: String,
        /// The level.
        level: String,
        /// What is wanted.
        wanted: &'static str,
    },
    /// An answer that the procedure does not have.
    #[error("the answer {answer} is not {wanted}")]
    BadAnswer {
        /// The answer.
        answer: f64,
        /// What is wanted.
        wanted: &'static str,
    },
    /// An answer without a question, or a presentation in a break.
    #[error("{what}, but there is nothing to answer")]
    NoTrial {
        /// What came.
        what: &'static str,
    },
    /// The session on the arm.
    #[error(transparent)]
    Session(#[from] hwall::SessionError),
    /// The simulated arm.
    #[error(transparent)]
    Sim(#[from] hwall::sim::SimError),
    /// The design or the analysis.
    #[error(transparent)]
    Psychophysics(#[from] hwall::psychophysics::PsychophysicsError),
}

impl StudyError {
    pub(crate) fn io(path: &Path, error: &std::io::Error) -> Self {
        Self::File {
            name: path.display().to_string(),
            kind: error.kind(),
            message: error.to_string(),
        }
    }
}
