//! The one error type of the crate.

use hwall_protobuf::ProtobufError;
use std::io;
use std::path::PathBuf;

/// Why a recording cannot be written, or what is wrong with a recording that was read.
///
/// Offsets count bytes from the start of the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// A file that cannot be opened, read or written.
    #[error("{}: {error}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// The cause; its kind states the type of failure.
        error: io::Error,
    },
    /// Another program is recording to the file.
    #[error("{}: another program is recording to this file", path.display())]
    InUse {
        /// Which file.
        path: PathBuf,
    },
    /// The MCAP writer reported an error.
    #[error("the MCAP writer: {0}")]
    Mcap(mcap::McapError),
    /// The writing thread could not be started, or panicked.
    #[error("the thread that writes the recording {0}")]
    Thread(&'static str),
    /// A configuration value outside its range.
    #[error(transparent)]
    Argument(#[from] hwall::numeric::ArgumentError),
    /// The drawn arm is not the one that the session moves.
    #[error("the links of the arm end {distance_m} m from the board of its kinematics")]
    OtherArm {
        /// Distance at the zero configuration, m.
        distance_m: f64,
    },
    /// An arm that a recording cannot hold.
    #[error("an arm of {joints} joints; a recording holds arms of 1 to 7")]
    JointCount {
        /// Its number of joints.
        joints: usize,
    },
    /// A configuration that the kinematics rejects.
    #[error(transparent)]
    Kinematics(#[from] hwall::kinematics::KinematicsError),
    /// A scene with invalid moving surfaces.
    #[error(transparent)]
    Session(#[from] hwall::SessionError),
    /// A surface that does not exist.
    #[error(transparent)]
    Scene(#[from] hwall::scene::SceneError),
    /// Not an MCAP file.
    #[error("not an MCAP file: it does not begin with the magic bytes of one")]
    NotMcap,
    /// A record without the contents that its kind requires.
    #[error("byte {offset}: a {kind} record without {missing}")]
    BadRecord {
        /// Where the record begins.
        offset: u64,
        /// Its kind.
        kind: &'static str,
        /// What is missing.
        missing: &'static str,
    },
    /// A compressed chunk. Other tools read these; recordings of this crate have none.
    #[error("byte {offset}: a chunk compressed as {compression:?}; decompress the file first")]
    Compressed {
        /// Where the chunk begins.
        offset: u64,
        /// The compression.
        compression: String,
    },
    /// Bytes that changed after they were written.
    #[error("byte {offset}: the checksum of the chunk is {found:#010x}, not {expected:#010x}")]
    Checksum {
        /// Where the chunk begins.
        offset: u64,
        /// The checksum in the file.
        expected: u32,
        /// The checksum of the bytes.
        found: u32,
    },
    /// No message with the setup of the session.
    #[error("no /session/setup: not a recording of a session, or cut before its first chunk")]
    NoSetup,
    /// A message whose bytes cannot be decoded.
    #[error("{channel} at byte {offset}: {problem}")]
    Message {
        /// Its channel.
        channel: &'static str,
        /// Where the message begins; the offset in `problem` counts from there.
        offset: u64,
        /// What is wrong.
        problem: ProtobufError,
    },
    /// A message with invalid values.
    #[error("{channel} at byte {offset}: {field}: {problem}")]
    Value {
        /// Its channel.
        channel: &'static str,
        /// Where the message begins.
        offset: u64,
        /// Which field.
        field: &'static str,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// A cycle, a frame or another input before the first run began.
    #[error("{channel} at byte {offset}: before the first /session/run")]
    BeforeRun {
        /// Its channel.
        channel: &'static str,
        /// Where the message begins.
        offset: u64,
    },
}

impl From<mcap::McapError> for RecordError {
    fn from(error: mcap::McapError) -> Self {
        Self::Mcap(error)
    }
}

impl RecordError {
    pub(crate) fn io(path: &std::path::Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |error| Self::Io { path, error }
    }
}
