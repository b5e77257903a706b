//! The one error type of the crate.

use crate::protocol::{ArmKind, Participants};
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
        /// Kind of failure.
        kind: ErrorKind,
        /// Message of the system.
        message: String,
    },
    /// A new study in a folder that already holds one.
    #[error("{name} holds a study already; resume it (--resume), or choose another folder")]
    Exists {
        /// The folder.
        name: String,
    },
    /// A new study in a folder that holds other files.
    #[error("{name} is not empty and holds no study; choose another folder")]
    NotEmpty {
        /// The folder.
        name: String,
    },
    /// A log that another program is writing.
    #[error("{name} is in use: another run is going on with this study")]
    InUse {
        /// The log.
        name: String,
    },
    /// A file that is not a log.
    #[error("{name} is not the log of a study; it was left as it is")]
    NotALog {
        /// The file.
        name: String,
    },
    /// A log truncated in its first line: nothing was recorded, and a new study may begin there.
    #[error("{name} holds no event: the study was cut before anything was recorded")]
    NothingRecorded {
        /// The log.
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
    /// The last line of the log is changed but has its line feed; a truncated line would have none.
    #[error(
        "line {line}, the last of the log, does not match its checksum though it is whole: it was changed, not cut; \
         the study goes on when that line is removed"
    )]
    DamagedEnd {
        /// The line, from 1.
        line: usize,
    },
    /// An event that cannot be restored exactly from its line, for instance one with NaN.
    #[error("the event {event} cannot be stored: it does not come back as it was written")]
    NotStorable {
        /// The kind of event.
        event: &'static str,
    },
    /// A study with people used for a simulation, or vice versa.
    #[error("the study is one with {stored}, not with {asked}")]
    OtherParticipants {
        /// Participants according to the log.
        stored: Participants,
        /// Participants requested.
        asked: Participants,
    },
    /// A study begun on one kind of arm and resumed on another.
    #[error("the study is one on {stored}, not on {asked}")]
    OtherArm {
        /// Kind of arm according to the log.
        stored: ArmKind,
        /// Kind of arm requested.
        asked: ArmKind,
    },
    /// A scene without a surface that a condition needs.
    #[error("the scene has no {surface} with a roughness to be touched, which the study asks for")]
    NoSurface {
        /// Kind of surface: wall, door or panel.
        surface: &'static str,
    },
    /// The arm presents no more trials.
    #[error("the arm presents no more trials: {why}")]
    ArmEnded {
        /// The reason, with the final state of the session.
        why: String,
    },
    /// A log that does not begin with a protocol, or with one of another version.
    #[error("the log holds no study: {why}")]
    NoStudy {
        /// The reason.
        why: &'static str,
    },
    /// An event of the log that does not follow from those before it.
    #[error("event {event} of the log does not follow from those before it: {why}")]
    OutOfOrder {
        /// The event, from 1.
        event: usize,
        /// The reason.
        why: &'static str,
    },
    /// A factor that no presenter supports.
    #[error(
        "factor {factor:?} cannot be presented, only angle, speed, surface, patch and question"
    )]
    UnknownFactor {
        /// The factor.
        factor: String,
    },
    /// Two factors that set the same quantity.
    #[error("factors {first:?} and {second:?} both set the {quantity}")]
    SameQuantity {
        /// The first of them.
        first: String,
        /// The second.
        second: String,
        /// The quantity.
        quantity: &'static str,
    },
    /// A name that no ready protocol has.
    #[error("no protocol {name:?}; there are {known}")]
    UnknownProtocol {
        /// The name.
        name: String,
        /// All names.
        known: String,
    },
    /// A level that cannot be presented.
    #[error("level {level:?} of {factor} is not {wanted}")]
    BadLevel {
        /// The factor.
        factor: String,
        /// The level.
        level: String,
        /// The accepted levels.
        wanted: &'static str,
    },
    /// A staircase or QUEST with more factors than one.
    #[error("a staircase or QUEST goes along one factor, not along {got}")]
    SeveralFactors {
        /// How many there are.
        got: usize,
    },
    /// A staircase or QUEST with too few levels.
    #[error(
        "a staircase or QUEST needs three levels of {factor} or more, got {got}: the first, which the others are compared \
         with, and two to go along"
    )]
    FewLevels {
        /// The factor.
        factor: String,
        /// How many levels it has.
        got: usize,
    },
    /// An answer that the procedure does not accept.
    #[error("the answer {answer} is not {wanted}")]
    BadAnswer {
        /// The answer.
        answer: f64,
        /// The accepted answers.
        wanted: &'static str,
    },
    /// An answer without a question, or a presentation in a break.
    #[error("{what}, but there is nothing to answer")]
    NoTrial {
        /// The call.
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
