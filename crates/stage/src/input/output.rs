//! Text and tables to a file or to standard output; a file appears only when complete.

use anyhow::Context;
use hwall_files::NewFile;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// A file, or standard output, buffered; a file appears under its name at [`finish`](Self::finish).
pub struct Output(Sink);

enum Sink {
    File(NewFile, PathBuf),
    Standard(BufWriter<io::StdoutLock<'static>>),
}

impl Output {
    /// Flushes and gives the file its name.
    ///
    /// # Errors
    /// A full disk, a closed pipe.
    pub fn finish(self) -> anyhow::Result<()> {
        match self.0 {
            Sink::File(file, path) => file.finish().with_context(|| path.display().to_string()),
            Sink::Standard(mut out) => out.flush().context("standard output"),
        }
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.0 {
            Sink::File(file, _) => file.write(bytes),
            Sink::Standard(out) => out.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.0 {
            Sink::File(file, _) => file.flush(),
            Sink::Standard(out) => out.flush(),
        }
    }
}

/// Rows of CSV; a file appears under its name at [`flush`](Self::flush).
pub struct TableWriter {
    rows: Option<csv::Writer<Output>>,
    name: String,
}

impl TableWriter {
    /// Adds a row.
    ///
    /// # Errors
    /// A full disk, a closed pipe, a row of another length; a table that has ended.
    pub fn write_record<I, T>(&mut self, cells: I) -> anyhow::Result<()>
    where
        I: IntoIterator<Item = T>,
        T: AsRef<[u8]>,
    {
        let written = self.rows()?.write_record(cells);
        written.with_context(|| self.name.clone())
    }

    /// Lets `work` write the rows and ends the table. If it fails, standard output keeps the rows so far, and a
    /// file is unchanged.
    ///
    /// # Errors
    /// Errors of `work`; a full disk, a closed pipe.
    pub fn fill<F>(mut self, work: F) -> anyhow::Result<()>
    where
        F: FnOnce(&mut csv::Writer<Output>) -> anyhow::Result<()>,
    {
        work(self.rows()?)?;
        self.flush()
    }

    fn rows(&mut self) -> anyhow::Result<&mut csv::Writer<Output>> {
        self.rows.as_mut().context("a table that has ended")
    }

    /// Ends the table: flushes and gives a file its name. A table dropped without this leaves no
    /// file.
    ///
    /// # Errors
    /// A full disk, a closed pipe.
    pub fn flush(&mut self) -> anyhow::Result<()> {
        let table = self.rows.take().context("a table that has ended")?;
        let output = table.into_inner().map_err(|error| {
            let (kind, text) = (error.error().kind(), error.error().to_string());
            io::Error::new(kind, text)
        });
        let output = output.with_context(|| self.name.clone())?;
        output.finish()
    }
}

/// A CSV writer to a file, or to standard output for `None`.
///
/// # Errors
/// A file that cannot be created.
pub fn writer(path: Option<&Path>) -> anyhow::Result<TableWriter> {
    Ok(TableWriter {
        rows: Some(csv::Writer::from_writer(output(path)?)),
        name: path.map_or("standard output".to_owned(), |p| p.display().to_string()),
    })
}

/// A file, or standard output for `None`, buffered.
///
/// # Errors
/// A file that cannot be created.
pub fn output(path: Option<&Path>) -> anyhow::Result<Output> {
    Ok(Output(match path {
        None => Sink::Standard(BufWriter::new(io::stdout().lock())),
        Some(path) => {
            let file = NewFile::create(path).with_context(|| path.display().to_string())?;
            Sink::File(file, path.to_owned())
        }
    }))
}

/// Writes a whole file.
///
/// # Errors
/// A file that cannot be written.
pub fn write_file(path: &Path, bytes: impl AsRef<[u8]>) -> anyhow::Result<()> {
    hwall_files::write(path, bytes).with_context(|| path.display().to_string())
}

/// Removes an earlier run's files with these names, which this run does not write: otherwise they would look like part of this
/// run. Returns a line about it; `None` if there was nothing.
///
/// # Errors
/// A file that cannot be removed.
pub fn remove_outdated(folder: &Path, names: &[&str]) -> anyhow::Result<Option<String>> {
    let mut removed = Vec::new();
    for name in names {
        let path = folder.join(name);
        if path.is_file() {
            std::fs::remove_file(&path).with_context(|| path.display().to_string())?;
            removed.push(*name);
        }
    }
    Ok((!removed.is_empty()).then(|| format!("removed {} of an earlier run", removed.join(", "))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_table_that_fails_halfway_leaves_the_good_file() {
        let folder = std::env::temp_dir().join(format!("hwall_output_{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("t.csv");
        fs::write(&path, "a,b\n1,2\n").unwrap();
        let mut table = writer(Some(&path)).unwrap();
        table.write_record(["a", "b"]).unwrap();
        assert!(table.write_record(["1"]).is_err());
        drop(table);
        assert_eq!(fs::read_to_string(&path).unwrap(), "a,b\n1,2\n");
        let mut table = writer(Some(&path)).unwrap();
        table.write_record(["c"]).unwrap();
        table.flush().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "c\n");
        assert!(table.flush().is_err() && table.write_record(["d"]).is_err());
        let fill = |fails: bool| {
            writer(Some(&path))?.fill(|rows| {
                rows.write_record(["d"])?;
                // Writers to a pipe flush their rows before they fail.
                rows.flush()?;
                anyhow::ensure!(!fails, "no more");
                Ok(())
            })
        };
        assert!(fill(true).is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "c\n");
        fill(false).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "d\n");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
    }

    /// Regression: `hwall.glb` of an earlier run stayed beside the replay of another one.
    #[test]
    fn what_an_earlier_run_left_is_removed() {
        let folder = std::env::temp_dir().join(format!("hwall_outdated_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for name in ["a", "b", "mine"] {
            std::fs::write(folder.join(name), "old").unwrap();
        }
        let said = remove_outdated(&folder, &["a", "b", "c"]).unwrap();
        assert_eq!(said.as_deref(), Some("removed a, b of an earlier run"));
        assert_eq!(remove_outdated(&folder, &["a", "c"]).unwrap(), None);
        assert!(!folder.join("a").exists() && folder.join("mine").exists());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
