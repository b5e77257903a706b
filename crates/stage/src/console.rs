//! What a program prints while its real work goes into files.

use anyhow::Context;
use std::fmt::Display;
use std::io::{self, Write};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;

/// Text that never stops the work: the first error of the output is kept until the end, and what comes after it is dropped.
///
/// So a program writes its files also when whoever reads its tables has left (`| head -1`) or the disk behind them is
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

    /// Notes an error, except one after which the same bytes are tried again.
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

/// Does the work of a program; what it prints goes to standard output, and files come first.
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

/// A line for the user on standard error, which is no reason to fail if nobody reads it. While there are [`NotesApart`], their thread
/// writes it.
pub fn note(line: impl Display) {
    let line = line.to_string();
    let apart = APART.lock().unwrap_or_else(PoisonError::into_inner);
    match &*apart {
        // A terminal that takes nothing for this long has nobody before it.
        Some(apart) => drop(apart.try_send(line)),
        None => {
            let _ = writeln!(io::stderr(), "{line}");
        }
    }
}

/// Lines that wait at most for a terminal that stands still.
const MOST_WAITING: usize = 1024;

static APART: Mutex<Option<SyncSender<String>>> = Mutex::new(None);

/// A thread of its own writes what is [noted](note), so that a terminal that stands still does not stop a control loop. Until dropped.
#[derive(Debug)]
pub struct NotesApart(Option<JoinHandle<()>>);

impl NotesApart {
    /// Begins; without a thread lines are written where they are noted.
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
    /// Writes what waits.
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

    /// Takes so many bytes, then nobody reads any more.
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
