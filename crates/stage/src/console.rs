//! Console output of a program whose results go into files.

use anyhow::Context;
use std::fmt::Display;
use std::io::{self, Write};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;

/// Text output that never stops the work: keeps the first error until the end, and drops all later text.
///
/// A program then still writes its files if the reader of its tables has left (`| head -1`) or the device is
/// full.
#[derive(Debug)]
pub struct Printout<W> {
    out: W,
    failed: Option<io::Error>,
}

impl<W: Write> Printout<W> {
    /// Begins a text.
    pub const fn new(out: W) -> Self {
        Self { out, failed: None }
    }

    /// Ends it.
    ///
    /// # Errors
    /// The first error of the output.
    pub fn finish(mut self) -> io::Result<()> {
        self.flush()?;
        self.failed.map_or(Ok(()), Err)
    }

    /// Keeps an error, except one after which the same bytes are retried.
    fn kept<T>(&mut self, done: io::Result<T>, instead: T) -> io::Result<T> {
        match done {
            Err(error) if error.kind() != io::ErrorKind::Interrupted => {
                self.failed = Some(error);
                Ok(instead)
            }
            done => done,
        }
    }
}

impl<W: Write> Write for Printout<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.failed.is_some() {
            return Ok(bytes.len());
        }
        let written = self.out.write(bytes);
        self.kept(written, bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.failed.is_some() {
            return Ok(());
        }
        let flushed = self.out.flush();
        self.kept(flushed, ())
    }
}

/// Runs `work`, with its text on standard output; output errors do not stop it from writing files.
///
/// # Errors
/// That of `work`; afterwards one of the output.
pub fn printed<F>(work: F) -> anyhow::Result<()>
where
    F: FnOnce(&mut Printout<io::Stdout>) -> anyhow::Result<()>,
{
    let mut out = Printout::new(io::stdout());
    work(&mut out)?;
    out.finish().context("standard output")
}

/// Prints a line for the user on standard error; ignores errors. While there are [`NotesApart`], their thread
/// writes it.
pub fn note(line: impl Display) {
    let line = line.to_string();
    let apart = APART.lock().unwrap_or_else(PoisonError::into_inner);
    match &*apart {
        // Drop the line if the queue is full: the terminal is stalled.
        Some(apart) => drop(apart.try_send(line)),
        None => {
            let _ = writeln!(io::stderr(), "{line}");
        }
    }
}

/// Largest number of lines waiting for a stalled terminal.
const MOST_WAITING: usize = 1024;

static APART: Mutex<Option<SyncSender<String>>> = Mutex::new(None);

/// Until dropped, a separate thread writes the [notes](note), so that a stalled terminal does not stop a control loop.
#[derive(Debug)]
pub struct NotesApart(Option<JoinHandle<()>>);

impl NotesApart {
    /// Starts the thread; if that fails, the caller of `note` writes.
    #[must_use]
    pub fn begin() -> Self {
        let (sender, lines) = sync_channel::<String>(MOST_WAITING);
        let writes = move || {
            for line in lines {
                let _ = writeln!(io::stderr(), "{line}");
            }
        };
        let builder = std::thread::Builder::new().name("notes".to_owned());
        let writer = builder.spawn(writes).ok();
        let mut apart = APART.lock().unwrap_or_else(PoisonError::into_inner);
        *apart = writer.is_some().then_some(sender);
        Self(writer)
    }
}

impl Drop for NotesApart {
    /// Writes the waiting lines.
    fn drop(&mut self) {
        *APART.lock().unwrap_or_else(PoisonError::into_inner) = None;
        if let Some(writer) = self.0.take() {
            let _ = writer.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Accepts this many bytes, then the reader is gone.
    struct Leaves(usize);

    impl Write for Leaves {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            match self.0 {
                0 => Err(io::ErrorKind::BrokenPipe.into()),
                room => {
                    let taken = room.min(bytes.len());
                    self.0 -= taken;
                    Ok(taken)
                }
            }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_reader_that_leaves_is_said_at_the_end() {
        let mut out = Printout::new(Leaves(10));
        for _ in 0..5 {
            writeln!(out, "a line").unwrap();
        }
        let error = out.finish().unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::BrokenPipe);
        let mut out = Printout::new(Leaves(10));
        writeln!(out, "a line").unwrap();
        out.finish().unwrap();
    }
}
