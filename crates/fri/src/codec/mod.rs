//! Converts messages to datagrams and back, without allocation.

mod command;
mod frame;
pub(crate) mod message;
mod monitor;
mod parts;
mod reading;
pub(crate) mod states;
pub(crate) mod version;

pub use command::COMMAND_MESSAGE_ID;
pub use message::{
    CartesianPose, CommandData, CommandMessage, ConnectionInfo, Header, InterpolatorData, JOINTS,
    MonitorData, MonitorMessage, Redundancy, RobotInfo, TimeStamp,
};
pub use monitor::MONITOR_MESSAGE_ID;
pub use states::{
    ClientCommandMode, ConnectionQuality, ControlMode, DriveState, OperationMode, OverlayType,
    SafetyState, SessionState,
};
pub use version::FriVersion;

use crate::error::FriError;
use hwall_protobuf::Writer;

/// Largest datagram that either side sends.
pub const DATAGRAM_BYTES: usize = 1500;

/// A buffer for the largest datagram.
pub type Datagram = [u8; DATAGRAM_BYTES];

/// Writes and reads the messages of one version. Allocates nothing, and accepts any bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Codec {
    /// The version.
    pub version: FriVersion,
}

impl Codec {
    /// The codec of a version.
    #[must_use]
    pub const fn new(version: FriVersion) -> Self {
        Self { version }
    }

    /// Writes a message of the controller; returns the size of the datagram.
    ///
    /// # Errors
    /// None with a buffer of [`DATAGRAM_BYTES`]: every message fits.
    pub fn encode_monitor(
        &self,
        message: &MonitorMessage,
        buffer: &mut [u8],
    ) -> Result<usize, FriError> {
        self.encode(buffer, |writer| {
            monitor::write(writer, message, self.version);
        })
    }

    /// The same with unknown numbers in the robot's information.
    pub(crate) fn encode_odd_monitor(
        &self,
        message: &MonitorMessage,
        buffer: &mut [u8],
    ) -> Result<usize, FriError> {
        let message = MonitorMessage {
            robot: None,
            ..*message
        };
        self.encode(buffer, |writer| {
            monitor::write(writer, &message, self.version);
            monitor::write_unknown_robot(writer);
        })
    }

    /// Writes a message of the client; returns the size of the datagram.
    ///
    /// # Errors
    /// None with a buffer of [`DATAGRAM_BYTES`]: every message fits.
    pub fn encode_command(
        &self,
        message: &CommandMessage,
        buffer: &mut [u8],
    ) -> Result<usize, FriError> {
        self.encode(buffer, |writer| {
            command::write(writer, message, self.version);
        })
    }

    /// Reads a message of the controller.
    ///
    /// # Errors
    /// Bytes that are not such a message, with the reason.
    pub fn decode_monitor(&self, datagram: &[u8]) -> Result<MonitorMessage, FriError> {
        monitor::read(self.message(datagram)?, self.version)
    }

    /// Reads a message of the client.
    ///
    /// # Errors
    /// Bytes that are not such a message, with the reason.
    pub fn decode_command(&self, datagram: &[u8]) -> Result<CommandMessage, FriError> {
        command::read(self.message(datagram)?, self.version)
    }

    fn encode(&self, buffer: &mut [u8], body: impl FnOnce(&mut Writer)) -> Result<usize, FriError> {
        let from = match self.version.is_framed() {
            true => frame::LENGTH_BYTES,
            false => 0,
        };
        let capacity = buffer.len();
        let no_space = FriError::Wire(hwall_protobuf::ProtobufError::NoSpace { capacity });
        let free = buffer.get_mut(from..).ok_or(no_space)?;
        let mut writer = Writer::to_slice(free);
        body(&mut writer);
        let bytes = writer.finish()?;
        match self.version.is_framed() {
            true => frame::close(buffer, bytes),
            false => Ok(bytes),
        }
    }

    fn message<'a>(&self, datagram: &'a [u8]) -> Result<&'a [u8], FriError> {
        match self.version.is_framed() {
            true => frame::open(datagram),
            false => Ok(datagram),
        }
    }
}
