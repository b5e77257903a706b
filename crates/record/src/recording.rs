//! A recording, read back.

use crate::error::RecordError;
use crate::file::{Ending, MessageAt, read_messages};
use crate::input::Input;
use crate::message::session::{self, Body};
use crate::setup::Setup;
use std::path::Path;

/// A recording of sessions, read from a file that may be truncated anywhere.
#[derive(Debug, Clone)]
pub struct Recording {
    bytes: Vec<u8>,
    setup: Setup,
    messages: Vec<MessageAt>,
    ending: Ending,
}

const SETUP_NUMBER: usize = 0;
const CHANNELS: [&str; 7] = [
    session::SETUP,
    session::RUN,
    session::FRAME,
    session::WORLD,
    session::REQUEST,
    session::CYCLE,
    session::END,
];

impl Recording {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read; otherwise as for [`Recording::from_bytes`].
    pub fn open(path: &Path) -> Result<Self, RecordError> {
        Self::from_bytes(std::fs::read(path).map_err(RecordError::io(path))?)
    }

    /// Reads an MCAP file without compressed chunks. Channels other than those of a session are skipped. A truncated file is read as far as
    /// possible, see [`Recording::ending`].
    ///
    /// # Errors
    /// Bytes that are not an MCAP file, inconsistent records, a chunk with a wrong checksum, a missing or malformed setup.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, RecordError> {
        let (mut setup_at, mut messages) = (None, Vec::new());
        let mut ending = read_messages(&bytes, &CHANNELS, |message| {
            if message.channel == CHANNELS[SETUP_NUMBER] {
                setup_at.get_or_insert(message);
            } else {
                messages.push(message);
            }
        })?;
        let setup_at = setup_at.ok_or(RecordError::NoSetup)?;
        let setup = body(&bytes, &setup_at).setup()?;
        let finished = messages.last().is_some_and(|m| m.channel == session::END);
        ending = match ending {
            Ending::Unfinished if finished => Ending::Finished,
            Ending::Cut { offset } if finished => Ending::CutBehind { offset },
            other => other,
        };
        Ok(Self {
            bytes,
            setup,
            messages,
            ending,
        })
    }

    /// The setup of the sessions.
    #[must_use]
    pub const fn setup(&self) -> &Setup {
        &self.setup
    }

    /// How the file ends.
    #[must_use]
    pub const fn ending(&self) -> Ending {
        self.ending
    }

    /// The inputs and outputs of the sessions, in order.
    #[must_use]
    pub fn inputs(&self) -> Inputs<'_> {
        Inputs {
            recording: self,
            next: 0,
            begun: false,
        }
    }
}

fn body<'a>(bytes: &'a [u8], message: &MessageAt) -> Body<'a> {
    Body {
        channel: message.channel,
        offset: message.data.start as u64,
        bytes: bytes.get(message.data.clone()).unwrap_or_default(),
    }
}

/// The inputs of a recording, see [`Recording::inputs`]. Each comes with its number among all messages of the sessions; a skipped number is
/// a dropped message.
#[derive(Debug, Clone)]
pub struct Inputs<'a> {
    recording: &'a Recording,
    next: usize,
    begun: bool,
}

impl Iterator for Inputs<'_> {
    type Item = Result<(u64, Input), RecordError>;

    fn next(&mut self) -> Option<Self::Item> {
        let message = self.recording.messages.get(self.next)?;
        self.next += 1;
        let read = body(&self.recording.bytes, message).input();
        if let Ok((_, input)) = &read {
            let outside = matches!(input, Input::End { .. });
            self.begun |= matches!(input, Input::Run(_));
            if !(self.begun || outside) {
                return Some(Err(RecordError::BeforeRun {
                    channel: message.channel,
                    offset: message.data.start as u64,
                }));
            }
        }
        Some(read)
    }
}
