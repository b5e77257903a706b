//! A buffered writer whose file appears only when finished.

use crate::beside::Beside;
use std::fs::OpenOptions;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// A file under construction; it gets its name at [`finish`](Self::finish).
#[derive(Debug)]
pub struct NewFile {
    // Declared before `beside`, so that it is closed before `beside` removes the file.
    file: BufWriter<std::fs::File>,
    beside: Beside,
}

impl NewFile {
    /// Begins the file.
    ///
    /// # Errors
    /// As [`Beside::new`].
    pub fn create(path: impl AsRef<Path>) -> io::Result<Self> {
        let beside = Beside::new(path)?;
        let file = OpenOptions::new().write(true).open(beside.path())?;
        Ok(Self {
            file: BufWriter::with_capacity(1 << 16, file),
            beside,
        })
    }

    /// Flushes and gives the file its name.
    ///
    /// # Errors
    /// A full disk, a file that cannot be renamed; the old file then stays unchanged.
    pub fn finish(self) -> io::Result<()> {
        let Self { mut file, beside } = self;
        file.flush()?;
        drop(file);
        beside.finish()
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Writes a file, all or nothing.
///
/// # Errors
/// As [`NewFile::create`] and [`NewFile::finish`].
pub fn write(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    let mut file = NewFile::create(path)?;
    file.write_all(bytes.as_ref())?;
    file.finish()
}
