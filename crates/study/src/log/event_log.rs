//! The file of the log.

use super::event::Event;
use super::line::{START, decode, encode, holds_log_lines, is_cut_first_line};
use crate::error::StudyError;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// When an event counts as written: guarantees against loss.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Durability {
    /// When it is on the disk: a power cut loses nothing.
    #[default]
    Disk,
    /// When the operating system has it: a crash of the program loses nothing. For simulations.
    System,
}

/// An append-only file of events.
#[derive(Debug)]
pub struct EventLog {
    path: PathBuf,
    file: File,
    sum: u32,
    durability: Durability,
    /// A write failed: refuse further events, which would hide the failure.
    broken: bool,
}

/// Contents of an opened log.
#[derive(Debug, Clone, PartialEq)]
pub struct Recovered {
    /// The events, in order.
    pub events: Vec<Event>,
    /// Bytes of an incomplete last line.
    pub dropped_bytes: u64,
}

impl EventLog {
    /// Creates a log under an exclusive lock: no other run can write to it. Overwrites the truncated first line of an earlier
    /// log.
    ///
    /// # Errors
    /// A file that cannot be created; [`StudyError::InUse`]; [`StudyError::Exists`] for a log with events,
    /// [`StudyError::NotALog`] for any other file.
    pub fn create(path: &Path, durability: Durability) -> Result<Self, StudyError> {
        let failed = |error: std::io::Error| StudyError::io(path, &error);
        let mut options = OpenOptions::new();
        let (file, bytes) = locked(path, options.create(true))?;
        match read(&bytes) {
            Err(Unreadable::Nothing) => {}
            Err(error @ Unreadable::NotALog) => return Err(named(error, path)),
            Ok(_) | Err(Unreadable::Changed(_) | Unreadable::DamagedEnd(_)) => {
                return Err(StudyError::Exists {
                    name: path.display().to_string(),
                });
            }
        }
        file.set_len(0).map_err(failed)?;
        if durability == Durability::Disk {
            file.sync_all().map_err(failed)?;
        }
        Ok(Self {
            path: path.to_owned(),
            file,
            sum: START,
            durability,
            broken: false,
        })
    }

    /// Reads a log and continues it, under a lock. Drops a last line without line feed, as a crash leaves it.
    ///
    /// # Errors
    /// A file that cannot be read or truncated; [`StudyError::InUse`]; [`StudyError::NothingRecorded`] for an incomplete first
    /// line; [`StudyError::NotALog`] for any other file, which is not touched; [`StudyError::Changed`] for a
    /// wrong line followed by others, [`StudyError::DamagedEnd`] for a wrong last line with a line feed.
    pub fn open(path: &Path, durability: Durability) -> Result<(Self, Recovered), StudyError> {
        let failed = |error: std::io::Error| StudyError::io(path, &error);
        let (file, bytes) = locked(path, &mut OpenOptions::new())?;
        let found = read(&bytes).map_err(|error| named(error, path))?;
        if found.whole < bytes.len() {
            file.set_len(found.whole as u64).map_err(failed)?;
            file.sync_all().map_err(failed)?;
        }
        let recovered = Recovered {
            events: found.events,
            dropped_bytes: (bytes.len() - found.whole) as u64,
        };
        let log = Self {
            path: path.to_owned(),
            file,
            sum: found.sum,
            durability,
            broken: false,
        };
        Ok((log, recovered))
    }

    /// Reads the events of a log without changing it; the log may be in use.
    ///
    /// # Errors
    /// As [`EventLog::open`], except [`StudyError::InUse`].
    pub fn events(path: &Path) -> Result<Vec<Event>, StudyError> {
        let bytes = std::fs::read(path).map_err(|error| StudyError::io(path, &error))?;
        Self::events_of(&bytes, path)
    }

    /// As [`EventLog::events`], from the bytes of a log; `path` is for errors.
    ///
    /// # Errors
    /// As [`EventLog::events`].
    pub fn events_of(bytes: &[u8], path: &Path) -> Result<Vec<Event>, StudyError> {
        let found = read(bytes).map_err(|error| named(error, path))?;
        Ok(found.events)
    }

    /// Writes an event; on return it is stored with the log's [`Durability`].
    ///
    /// # Errors
    /// [`StudyError::NotStorable`] for an event that cannot be restored exactly: nothing is written. A file that
    /// cannot be written: the log then accepts no more events.
    pub fn append(&mut self, event: &Event) -> Result<(), StudyError> {
        let failed = |error: std::io::Error| StudyError::io(&self.path, &error);
        if self.broken {
            return Err(failed(std::io::Error::other(
                "a write before this one failed",
            )));
        }
        // Verify that the line can be read back exactly.
        let encoded = encode(self.sum, event).filter(|(line, sum)| {
            let decoded = line
                .strip_suffix('\n')
                .and_then(|line| decode(self.sum, line.as_bytes()));
            decoded.is_some_and(|(back, own)| back == *event && own == *sum)
        });
        let Some((line, sum)) = encoded else {
            return Err(StudyError::NotStorable {
                event: event.word(),
            });
        };
        let written = self.file.write_all(line.as_bytes()).and_then(|()| {
            self.file.flush()?;
            match self.durability {
                Durability::Disk => self.file.sync_data(),
                Durability::System => Ok(()),
            }
        });
        self.broken = written.is_err();
        written.map_err(|error| StudyError::io(&self.path, &error))?;
        self.sum = sum;
        Ok(())
    }
}

struct Found {
    events: Vec<Event>,
    sum: u32,
    /// Bytes of complete lines.
    whole: usize,
}

/// Opens a file under an exclusive lock, and reads its bytes.
fn locked(path: &Path, options: &mut OpenOptions) -> Result<(File, Vec<u8>), StudyError> {
    let failed = |error: std::io::Error| StudyError::io(path, &error);
    let mut file = options.read(true).append(true).open(path).map_err(failed)?;
    file.try_lock().map_err(|error| match error {
        TryLockError::WouldBlock => StudyError::InUse {
            name: path.display().to_string(),
        },
        TryLockError::Error(error) => failed(error),
    })?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(failed)?;
    Ok((file, bytes))
}

/// Adds the file name to an error of [`read`].
fn named(error: Unreadable, path: &Path) -> StudyError {
    let name = path.display().to_string();
    match error {
        Unreadable::Nothing => StudyError::NothingRecorded { name },
        Unreadable::NotALog => StudyError::NotALog { name },
        Unreadable::Changed(line) => StudyError::Changed { line },
        Unreadable::DamagedEnd(line) => StudyError::DamagedEnd { line },
    }
}

/// Why bytes are not a log.
enum Unreadable {
    /// Less than one line of a log.
    Nothing,
    NotALog,
    /// The line, from 1.
    Changed(usize),
    DamagedEnd(usize),
}

fn read(bytes: &[u8]) -> Result<Found, Unreadable> {
    let mut found = Found {
        events: Vec::new(),
        sum: START,
        whole: 0,
    };
    for line in bytes.split_inclusive(|b| *b == b'\n') {
        let decoded = line
            .strip_suffix(b"\n")
            .and_then(|line| decode(found.sum, line));
        let Some((event, sum)) = decoded else {
            let number = found.events.len() + 1;
            let rest = bytes.get(found.whole..).unwrap_or_default();
            let first_feed = rest.iter().position(|b| *b == b'\n');
            return match first_feed {
                // Only the last write can be truncated: no line feed follows it.
                None if number > 1 => Ok(found),
                None if is_cut_first_line(rest) => Err(Unreadable::Nothing),
                None => Err(Unreadable::NotALog),
                Some(_) if number == 1 && !holds_log_lines(rest) => Err(Unreadable::NotALog),
                Some(at) if at + 1 == rest.len() => Err(Unreadable::DamagedEnd(number)),
                Some(_) => Err(Unreadable::Changed(number)),
            };
        };
        found.events.push(event);
        found.sum = sum;
        found.whole += line.len();
    }
    if found.events.is_empty() {
        return Err(Unreadable::Nothing);
    }
    Ok(found)
}
