//! The errors of the crate.

use crate::client::unfit::Unfit;
use crate::codec::states::{ClientCommandMode, ConnectionQuality, NoValue, SessionState};
use crate::codec::version::FriVersion;
use crate::limits::LimitViolation;
use hwall_numeric::ArgumentError;
use hwall_protobuf::ProtobufError;
use std::io;

/// An invalid datagram, command or setting, or a connection error.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FriError {
    /// An invalid setting or command.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// The bytes are not a protobuf message.
    #[error(transparent)]
    Wire(#[from] ProtobufError),
    /// A required field is missing.
    #[error("the message has no {0}")]
    Missing(&'static str),
    /// A message of another type, or of another robot.
    #[error("message identifier {found:#x} instead of {expected:#x}")]
    OtherMessage {
        /// Identifier found.
        found: u32,
        /// Identifier of the expected message.
        expected: u32,
    },
    /// A repeated field with a wrong number of values.
    #[error("{what}: {found} values instead of {expected}")]
    WrongLength {
        /// Which values.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there must be.
        expected: usize,
    },
    /// A value that is not in an enumeration.
    #[error("{value} is no {what}")]
    UnknownValue {
        /// Which enumeration.
        what: &'static str,
        /// The number.
        value: i32,
    },
    /// A time stamp with a second or more of nanoseconds.
    #[error("a time stamp with {nanoseconds} ns")]
    Nanoseconds {
        /// The number.
        nanoseconds: u32,
    },
    /// A datagram of 2.7 without space for its length and checksum.
    #[error("{found} bytes are too short for a framed datagram")]
    FrameTooShort {
        /// Bytes of the datagram.
        found: usize,
    },
    /// A datagram of 2.7 that is shorter than it says.
    #[error("a frame of {stated} bytes, of which {found} are there")]
    FrameLength {
        /// The stated length.
        stated: usize,
        /// The actual number of bytes.
        found: usize,
    },
    /// A datagram of 2.7 with a wrong checksum.
    #[error("checksum {stated:#010x}, the message has {found:#010x}")]
    Checksum {
        /// The stated checksum.
        stated: u32,
        /// Checksum of the message.
        found: u32,
    },
    /// An unknown version.
    #[error("`{0}` is no known version: 1.15, 2.5, 2.7")]
    UnknownVersion(String),
    /// An unknown command mode.
    #[error("`{0}` is no command mode")]
    UnknownMode(String),
    /// The mode needs an arm that accepts torques.
    #[error("{0} needs an arm that takes torques")]
    NeedsTorques(ClientCommandMode),
    /// A mode that the simulated controller does not have.
    #[error("the simulated controller has no mode {0}")]
    UnsupportedMode(ClientCommandMode),
    /// The network failed.
    #[error("{doing}: {kind}")]
    Io {
        /// What was being done.
        doing: &'static str,
        /// What failed.
        kind: io::ErrorKind,
    },
    /// An answer could not be sent; it counts as not arrived.
    #[error("an answer could not be sent: {kind}")]
    NotSent {
        /// What failed.
        kind: io::ErrorKind,
    },
    /// Nothing has come from the controller yet.
    #[error("no message from the controller yet")]
    NoMessage,
    /// Nothing came from the controller for too long.
    #[error("no message from the controller for {waited_s:.1} s{}", other(*other_version))]
    Silent {
        /// How long, s.
        waited_s: f64,
        /// The apparent version of its datagrams, if it differs from the client's.
        other_version: Option<FriVersion>,
    },
    /// A state without joint positions: the arm's position is unknown.
    #[error("the controller sends no joint positions")]
    NoPositions,
    /// The controller ended commanding.
    #[error("commanding has ended: the session is {state}, quality {quality}{}", cause(*quality))]
    CommandingEnded {
        /// State of the session now.
        state: SessionState,
        /// Quality of the connection now.
        quality: ConnectionQuality,
    },
    /// The arm accepts no commands; it brakes.
    #[error("no commands are given: {0}")]
    Unfit(#[from] Unfit),
    /// Too many answers were lost or not given; the arm brakes.
    #[error(
        "the arm is {behind_s:.2} s behind what was asked for: too many answers did not arrive; it brakes"
    )]
    Behind {
        /// The delay, s.
        behind_s: f64,
    },
    /// A command that the controller does not accept in its current mode.
    #[error("{asked} was commanded, the controller takes {mode}")]
    OtherMode {
        /// What was commanded.
        asked: &'static str,
        /// The mode chosen by the application on the controller.
        mode: ClientCommandMode,
    },
    /// A command outside the limits of the joints.
    #[error(transparent)]
    Limit(#[from] LimitViolation),
}

impl From<NoValue> for FriError {
    fn from(NoValue { what, value }: NoValue) -> Self {
        Self::UnknownValue { what, value }
    }
}

fn other(version: Option<FriVersion>) -> String {
    version.map_or_else(
        || ": see that it is on, connected, and that its application runs".to_owned(),
        |v| format!(", but datagrams of FRI {v}"),
    )
}

/// Why commanding ended, as far as the quality shows.
fn cause(quality: ConnectionQuality) -> &'static str {
    match quality >= ConnectionQuality::Good {
        true => "; its application or one of its limits ended the motion",
        false => ", and commands need GOOD",
    }
}

impl FriError {
    /// Can a loop continue, because the error may be gone at the next message? The arm holds meanwhile.
    #[must_use]
    pub const fn is_transient(&self) -> bool {
        matches!(
            self,
            Self::Behind { .. }
                | Self::NotSent { .. }
                | Self::Silent { .. }
                | Self::CommandingEnded { .. }
                | Self::Unfit(_)
                | Self::Limit(_)
                | Self::Argument(_)
                | Self::OtherMode { .. }
        )
    }

    pub(crate) fn io(doing: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |error| Self::Io {
            doing,
            kind: error.kind(),
        }
    }
}

/// An error of a running simulated controller: of the protocol, or of the simulated arm.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ControllerError<E: std::error::Error> {
    /// A setting or network error.
    #[error(transparent)]
    Fri(#[from] FriError),
    /// The simulated arm.
    #[error("the simulated arm: {0}")]
    Plant(#[source] E),
}
