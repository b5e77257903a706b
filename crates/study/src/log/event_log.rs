//! The file of the log.

use super::event::Event;
use super::line::{START, decode, encode};
use crate::error::StudyError;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// When an event counts as written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Durability {
    /// When the disk has it: a power cut loses nothing.
    #[default]
    Disk,
    /// When the system has it: the end of the program loses nothing. For simulations.
    System,
}

/// An append-only file of events.
#[derive(Debug)]
pub struct EventLog {
    path: PathBuf,
    file: File,
    sum: u32,
    durability: Durability,
    /// A write failed: what follows would hide it.
    broken: bool,
}

/// What was found in a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Recovered {
    /// The events, in order.
    pub events: Vec<Event>,
    /// Bytes of a last line that was not whole.
    pub dropped_bytes: u64,
}

impl EventLog {
    /// A new log.
    ///
    /// # Errors
    /// A file that exists already or cannot be made.
    pub fn create(path: &Path, durability: Durability) -> Result<Self, StudyError> {
        let file = OpenOptions::new()
            .read(true)
            .append(true)
            .create_new(true)
            .open(path);
        let file = file.map_err(|error| StudyError::io(path, &error))?;
        let log = Self {
            path: path.to_owned(),
            file,
            sum: START,
            durability,
            broken: false,
        };
        if durability == Durability::Disk
            && let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty())
            && let Ok(folder) = File::open(folder)
        {
            // The name of the file, too; where a system cannot, it does so by itself.
            let _ = folder.sync_all();
        }
        Ok(log)
    }

    /// Reads a log and goes on with it. A last line that is not whole, as a crash leaves it, is cut off.
    ///
    /// # Errors
    /// A file that cannot be read or cut; [`StudyError::Changed`] for a wrong line that others follow.
    pub fn open(path: &Path, durability: Durability) -> Result<(Self, Recovered), StudyError> {
        let failed = |error: std::io::Error| StudyError::io(path, &error);
        let file = OpenOptions::new().read(true).append(true).open(path);
        let mut file = file.map_err(failed)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let found = read(&bytes)?;
        if found.whole < bytes.len() {
            file.set_len(found.whole as u64).map_err(failed)?;
            file.seek(SeekFrom::End(0)).map_err(failed)?;
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

    /// Writes an event; when this returns, it is as safe as the log's [`Durability`] says.
    ///
    /// # Errors
    /// A file that cannot be written; after that the log takes nothing more.
    pub fn append(&mut self, event: &Event) -> Result<(), StudyError> {
        let failed = |error: std::io::Error| StudyError::io(&self.path, &error);
        if self.broken {
            return Err(failed(std::io::Error::other(
                "a write before this one failed",
            )));
        }
        let Some((line, sum)) = encode(self.sum, event) else {
            return Err(failed(std::io::Error::other("an event without a text")));
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
    /// Bytes of whole lines.
    whole: usize,
}

fn read(bytes: &[u8]) -> Result<Found, StudyError> {
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
            // A write that was cut is the last there is: no line feed comes after it.
            let rest = bytes.get(found.whole..).unwrap_or_default();
            let cut = rest.iter().filter(|b| **b == b'\n').count() == 0;
            if cut {
                break;
            }
            return Err(StudyError::Changed {
                line: found.events.len() + 1,
            });
        };
        found.events.push(event);
        found.sum = sum;
        found.whole += line.len();
    }
    Ok(found)
}
