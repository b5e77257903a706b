//! A file that is a whole MCAP file after every flush.

use crate::error::RecordError;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Ending of a file without a summary: the record that ends the data, a footer without a summary, the magic. Zero offsets and checksums
/// mean that there are none.
const TAIL: [u8; 13 + 29 + 8] = {
    let mut tail = [0; 50];
    tail[0] = 0x0f; // data end
    tail[1] = 4; // length of its body: a checksum
    tail[13] = 0x02; // footer
    tail[14] = 20; // length of its body: two offsets and a checksum
    let magic = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];
    let mut i = 0;
    while i < 8 {
        tail[42 + i] = magic[i];
        i += 1;
    }
    tail
};

/// Creates or empties a file for one writer at a time. The lock is released when the file is closed, including by a crash. A file system
/// without locks gives no such protection.
pub(crate) fn create_alone(path: &Path) -> Result<File, RecordError> {
    let io = |error| RecordError::io(path)(error);
    // Empties the file only when it is certain that nobody else writes to it.
    let mut options = OpenOptions::new();
    let file = options.write(true).create(true).truncate(false);
    let file = file.open(path).map_err(io)?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            return Err(RecordError::InUse {
                path: path.to_owned(),
            });
        }
        Err(TryLockError::Error(error)) if error.kind() == ErrorKind::Unsupported => {}
        Err(TryLockError::Error(error)) => return Err(io(error)),
    }
    file.set_len(0).map_err(io)?;
    Ok(file)
}

/// Buffers all bytes until the flush. The flush overwrites the previous ending with these bytes and a new ending, in one call. If the
/// program is killed, the file is valid and contains everything up to the last flush.
pub(crate) struct GrowingFile {
    file: File,
    /// Start of the ending, bytes from the start.
    end: u64,
    pending: Vec<u8>,
    /// The MCAP writer writes the ending itself.
    is_last: Arc<AtomicBool>,
}

impl GrowingFile {
    /// Once `is_last` is set, no ending is added: the MCAP writer writes it.
    pub(crate) fn new(file: File, is_last: Arc<AtomicBool>) -> Self {
        Self {
            file,
            end: 0,
            pending: Vec::new(),
            is_last,
        }
    }
}

impl Write for GrowingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.pending.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let length = self.pending.len() as u64;
        if length == 0 {
            return Ok(());
        }
        let is_last = self.is_last.load(Ordering::Relaxed);
        if !is_last {
            self.pending.extend_from_slice(&TAIL);
        }
        self.file.seek(SeekFrom::Start(self.end))?;
        self.file.write_all(&self.pending)?;
        self.end += length;
        self.pending.clear();
        if is_last {
            // The previous ending may have been longer.
            self.file.set_len(self.end)?;
        }
        self.file.flush()
    }
}

/// The MCAP writer asks for its position, but never seeks elsewhere while chunks are kept in memory.
impl Seek for GrowingFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = self.end + self.pending.len() as u64;
        match to {
            SeekFrom::Current(0) | SeekFrom::End(0) => Ok(at),
            SeekFrom::Start(place) if place == at => Ok(at),
            _ => Err(io::ErrorKind::Unsupported.into()),
        }
    }
}
