//! Tables of numbers as CSV: a header line, then one row of finite numbers on each line.

use crate::input::file_plan::FilePlan;
use anyhow::{Context, anyhow, bail, ensure};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

pub use crate::input::output::{Output, TableWriter, output, writer};

/// Where a command takes its table from.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct TableInput {
    /// Read this CSV file instead of standard input
    #[arg(long = "in", value_name = "FILE")]
    input: Option<PathBuf>,
    /// The same without the flag
    #[arg(value_name = "FILE", conflicts_with = "input")]
    table: Option<PathBuf>,
}

impl TableInput {
    /// The file; `None`: standard input.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        self.input.as_deref().or(self.table.as_deref())
    }

    /// What is read, and what to call it.
    ///
    /// # Errors
    /// A file that cannot be opened.
    pub fn open(&self) -> anyhow::Result<(String, Box<dyn Read>)> {
        source(self.path())
    }
}

/// The flags of a command that makes a table of a table.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct TableFiles {
    #[command(flatten)]
    input: TableInput,
    /// Write this CSV file instead of standard output
    #[arg(long = "out", value_name = "FILE")]
    output: Option<PathBuf>,
}

impl TableFiles {
    /// Where the table is read from.
    #[must_use]
    pub const fn input(&self) -> &TableInput {
        &self.input
    }

    /// Both, to be checked with the other files of the command before one of them is opened.
    #[must_use]
    pub fn plan(&self) -> FilePlan {
        FilePlan::default()
            .read("--in", self.input.path())
            .write("--out", self.output.as_deref())
    }

    /// The table that is read.
    ///
    /// # Errors
    /// As for [`NumberReader::open`].
    pub fn reader(&self) -> anyhow::Result<NumberReader> {
        NumberReader::open(self.input.path())
    }

    /// The table that is written; a file appears when it is whole.
    ///
    /// # Errors
    /// As for [`writer`].
    pub fn writer(&self) -> anyhow::Result<TableWriter> {
        writer(self.output.as_deref())
    }
}

/// Reads rows by column name; errors name line and column.
pub struct NumberReader {
    name: String,
    header: Vec<String>,
    lines: Rc<RefCell<LineStarts>>,
    records: csv::StringRecordsIntoIter<LineCounter<Box<dyn Read>>>,
}

/// One row, and where it was read.
pub struct NumberRow {
    line: u64,
    cells: csv::StringRecord,
}

impl NumberReader {
    /// Opens a file, or standard input for `None`.
    ///
    /// # Errors
    /// A file that cannot be opened, or input without a header line.
    pub fn open(path: Option<&Path>) -> anyhow::Result<Self> {
        let (name, source) = source(path)?;
        Self::from_source(name, source, None)
    }

    /// As [`open`](Self::open), but the header line may be missing: the columns are then `names`. A first line without a
    /// number in it is a header line.
    ///
    /// # Errors
    /// A file that cannot be opened, or input without any line.
    pub fn open_or(path: Option<&Path>, names: &[&str]) -> anyhow::Result<Self> {
        let (name, source) = source(path)?;
        Self::from_source(name, source, Some(names))
    }

    fn from_source(
        name: String,
        source: Box<dyn Read>,
        names: Option<&[&str]>,
    ) -> anyhow::Result<Self> {
        let lines = Rc::new(RefCell::new(LineStarts::default()));
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .has_headers(names.is_none())
            .from_reader(LineCounter {
                source,
                lines: Rc::clone(&lines),
            });
        let mut header: Vec<String> = reader
            .headers()
            .with_context(|| name.clone())?
            .iter()
            .map(|h| h.trim_start_matches('\u{feff}').to_owned())
            .collect();
        if header.iter().all(String::is_empty) {
            match names {
                None => bail!("{name}: no header line"),
                Some(_) => bail!("{name}: no rows"),
            }
        }
        let mut records = reader.into_records();
        if let Some(names) = names {
            if header.iter().any(|cell| cell.parse::<f64>().is_ok()) {
                header = names.iter().map(|&name| name.to_owned()).collect();
            } else {
                // The reader returns the header line as a row, too.
                records.next();
            }
        }
        Ok(Self {
            name,
            header,
            lines,
            records,
        })
    }

    /// Does the header hold this column?
    #[must_use]
    pub fn has(&self, column: &str) -> bool {
        self.header.iter().any(|h| h == column)
    }

    /// The names of the columns, in their order.
    #[must_use]
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// Places of the columns.
    ///
    /// # Errors
    /// A column that is missing or that appears twice.
    pub fn columns(&self, names: &[String]) -> anyhow::Result<Vec<usize>> {
        names
            .iter()
            .map(|name| {
                let mut places = (0..self.header.len()).filter(|&i| self.header[i] == *name);
                let first = places.next().with_context(|| {
                    format!(
                        "{}: no column {name:?} in the header {:?}",
                        self.name,
                        self.header.join(",")
                    )
                })?;
                if places.next().is_some() {
                    bail!("{}: column {name:?} appears twice", self.name);
                }
                Ok(first)
            })
            .collect()
    }

    /// The next row, or `None` at the end.
    ///
    /// # Errors
    /// A row with too few or too many cells, or text that is not UTF-8.
    pub fn next_row(&mut self) -> anyhow::Result<Option<NumberRow>> {
        match self.records.next() {
            None => Ok(None),
            Some(record) => {
                let cells = match record {
                    Ok(cells) => cells,
                    Err(error) => return Err(self.refused(error)),
                };
                let line = self.line(cells.position());
                let (expected, got) = (self.header.len(), cells.len());
                if got != expected {
                    let (name, columns) = (&self.name, self.header.join(","));
                    bail!("{name} line {line}: {got} cells, expected {expected}: {columns}");
                }
                Ok(Some(NumberRow { line, cells }))
            }
        }
    }

    fn line(&self, position: Option<&csv::Position>) -> u64 {
        position.map_or(0, |at| self.lines.borrow_mut().line_of(at.byte()))
    }

    fn refused(&self, error: csv::Error) -> anyhow::Error {
        let line = self.line(error.position());
        match *error.kind() {
            csv::ErrorKind::UnequalLengths {
                expected_len, len, ..
            } => anyhow!(
                "{} line {line}: {len} cells, the header has {expected_len}",
                self.name
            ),
            csv::ErrorKind::Utf8 { .. } => anyhow!("{} line {line}: not UTF-8 text", self.name),
            _ => anyhow::Error::new(error).context(self.name.clone()),
        }
    }

    /// The finite numbers of a row at the places that [`columns`](Self::columns) gave.
    ///
    /// # Errors
    /// A cell that is not a finite number.
    pub fn values(&self, row: &NumberRow, places: &[usize]) -> anyhow::Result<Vec<f64>> {
        places.iter().map(|&p| self.number(row, p)).collect()
    }

    /// As [`values`](Self::values); an empty cell is a missing value.
    ///
    /// # Errors
    /// A cell that is neither empty nor a finite number.
    pub fn values_or_missing(
        &self,
        row: &NumberRow,
        places: &[usize],
    ) -> anyhow::Result<Vec<Option<f64>>> {
        let cell = |&place: &usize| match &row.cells[place] {
            "" => Ok(None),
            _ => self.number(row, place).map(Some),
        };
        places.iter().map(cell).collect()
    }

    fn number(&self, row: &NumberRow, place: usize) -> anyhow::Result<f64> {
        let text = &row.cells[place];
        let value: Option<f64> = text.parse().ok().filter(|v: &f64| v.is_finite());
        value.with_context(|| {
            let column = &self.header[place];
            format!(
                "{} line {}, column {column}: {text:?} is not a finite number",
                self.name, row.line
            )
        })
    }

    /// Says where a row was read, for errors about its meaning.
    #[must_use]
    pub fn place(&self, row: &NumberRow) -> String {
        format!("{} line {}", self.name, row.line)
    }
}

/// A file or standard input, and what to call it.
fn source(path: Option<&Path>) -> anyhow::Result<(String, Box<dyn Read>)> {
    let Some(path) = path else {
        return Ok((
            "standard input".to_owned(),
            Box::new(std::io::stdin().lock()),
        ));
    };
    let name = path.display().to_string();
    let file = File::open(path).with_context(|| name.clone())?;
    Ok((name, Box::new(BufReader::new(file))))
}

/// Where the lines that are not empty begin, from the last record that was asked for.
///
/// The reader's own count of lines is wrong after CRLF and empty lines. This one counts as editors do.
#[derive(Default)]
struct LineStarts {
    /// First byte and number of each line, in order.
    starts: VecDeque<(u64, u64)>,
    /// Bytes read.
    bytes: u64,
    /// Line ends read.
    ends: u64,
    within_line: bool,
    after_cr: bool,
}

impl LineStarts {
    fn read(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            let end = matches!(byte, b'\r' | b'\n');
            if end {
                // The second half of a line end whose CR was counted already.
                let rest_of_end = byte == b'\n' && self.after_cr;
                self.ends += u64::from(!rest_of_end);
            } else if !self.within_line {
                self.starts.push_back((self.bytes, self.ends + 1));
            }
            self.within_line = !end;
            self.after_cr = byte == b'\r';
            self.bytes += 1;
        }
    }

    /// The line of the record at a byte; records come in order. A record's position may lie before the line
    /// ends that precede it.
    fn line_of(&mut self, byte: u64) -> u64 {
        while self.starts.front().is_some_and(|start| start.0 < byte) {
            self.starts.pop_front();
        }
        self.starts.front().map_or(self.ends + 1, |start| start.1)
    }
}

/// Notes the lines of what is read through it.
struct LineCounter<R> {
    source: R,
    lines: Rc<RefCell<LineStarts>>,
}

impl<R: Read> Read for LineCounter<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.source.read(buffer)?;
        self.lines.borrow_mut().read(&buffer[..count]);
        Ok(count)
    }
}

/// `prefix1..prefixN`.
#[must_use]
pub fn numbered(prefix: &str, count: usize) -> Vec<String> {
    (1..=count).map(|i| format!("{prefix}{i}")).collect()
}

/// `prefix11..prefixRC`, row by row.
#[must_use]
pub fn matrix_names(prefix: &str, rows: usize, columns: usize) -> Vec<String> {
    (1..=rows)
        .flat_map(|r| (1..=columns).map(move |c| format!("{prefix}{r}{c}")))
        .collect()
}

/// Numbers in the shortest form that reads back to the same bits.
pub fn to_cells(values: impl IntoIterator<Item = f64>) -> impl Iterator<Item = String> {
    values.into_iter().map(|v| v.to_string())
}

/// So many finite numbers, separated by commas.
///
/// # Errors
/// Another count, or a cell that is not a finite number.
pub fn list(text: &str, count: usize) -> anyhow::Result<Vec<f64>> {
    let values = text
        .split(',')
        .map(|cell| {
            let value: Option<f64> = cell.trim().parse().ok().filter(|v: &f64| v.is_finite());
            value.with_context(|| format!("{cell:?} is not a finite number"))
        })
        .collect::<anyhow::Result<Vec<f64>>>()?;
    let got = values.len();
    ensure!(got == count, "{got} numbers, expected {count}");
    Ok(values)
}

/// A count of a command line, from `LEAST` to `MOST`.
///
/// # Errors
/// Text that is no such count.
pub fn count_within<const LEAST: usize, const MOST: usize>(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|n| (LEAST..=MOST).contains(n));
    count.ok_or_else(|| format!("not a whole number from {LEAST} to {MOST}"))
}

/// A whole number of a command line, from `LEAST` to `MOST`.
///
/// # Errors
/// Text that is no such number.
pub fn whole_within<const LEAST: u64, const MOST: u64>(text: &str) -> Result<u64, String> {
    let number = text.parse().ok().filter(|n| (LEAST..=MOST).contains(n));
    number.ok_or_else(|| format!("not a whole number from {LEAST} to {MOST}"))
}

/// A number of a command line, finite and above zero.
///
/// # Errors
/// Text that is no such number.
pub fn positive(text: &str) -> Result<f64, String> {
    let value = text.parse().ok();
    let value = value.filter(|value: &f64| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| "not a number above 0".to_owned())
}

/// `1 reach`, `2 reaches`.
#[must_use]
pub fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns its bytes a few at a time, so that line ends are cut in two.
    struct Pieces(std::io::Cursor<Vec<u8>>, usize);

    impl Read for Pieces {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            let most = buffer.len().min(self.1);
            self.0.read(&mut buffer[..most])
        }
    }

    #[test]
    fn lines_are_counted_as_an_editor_does() {
        for piece in [1, 2, 5, 1000] {
            for (text, lines) in [
                ("a,b\n1,2\n3,4\n", &[2, 3][..]),
                ("a,b\r\n1,2\r\n3,4\r\n5,6", &[2, 3, 4]),
                ("\n\na,b\n\n1,2\n\n\n3,4\n\n", &[5, 8]),
                ("\r\na,b\r\n\r\n1,2\r\n\r\n\r\n3,4\r\n", &[4, 7]),
                ("a,b\r1,2\r\r3,4\r", &[2, 4]),
                ("\u{feff}a,b\n1,\"2\"\n3,4\n", &[2, 3]),
            ] {
                let bytes = std::io::Cursor::new(text.as_bytes().to_vec());
                let source = Box::new(Pieces(bytes, piece));
                let mut reader = NumberReader::from_source("it".to_owned(), source, None).unwrap();
                let mut found = Vec::new();
                while let Some(row) = reader.next_row().unwrap() {
                    found.push(row.line);
                }
                assert_eq!(found, lines, "{text:?} in pieces of {piece}");
            }
        }
    }

    #[test]
    fn a_short_row_is_named_by_its_line() {
        let text = "a,b\r\n\r\n1,2\r\n3\r\n";
        let source = Box::new(std::io::Cursor::new(text));
        let mut reader = NumberReader::from_source("it".to_owned(), source, None).unwrap();
        reader.next_row().unwrap();
        let error = reader.next_row().map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("line 4: 1 cells"), "{error}");
    }

    #[test]
    fn a_header_line_may_be_missing() {
        for (text, first, line) in [
            ("t,f\n1,2\n3,4\n", Some([1.0, 2.0]), 2),
            ("f,t\r\n\r\n2,1\r\n", Some([1.0, 2.0]), 3),
            ("1,2\n3,4\n", Some([1.0, 2.0]), 1),
            ("\n\n-1e-3,2\n", Some([-1e-3, 2.0]), 3),
            ("\u{feff}1,2\n", Some([1.0, 2.0]), 1),
            // Half a header is a bad row.
            ("t,2\n3,4\n", None, 1),
            ("nan,nan\n", None, 1),
            ("1\n2\n", None, 1),
            ("1,2,3\n", None, 1),
            ("1,2\n3\n", Some([1.0, 2.0]), 1),
        ] {
            let source = Box::new(std::io::Cursor::new(text));
            let names = ["t", "f"];
            let mut reader =
                NumberReader::from_source("it".to_owned(), source, Some(&names)).unwrap();
            let places = reader.columns(&names.map(String::from)).unwrap();
            let row = reader.next_row().map(|row| row.unwrap());
            let found = row.and_then(|row| Ok((reader.values(&row, &places)?, row.line)));
            match (first, found) {
                (Some(first), Ok(found)) => assert_eq!(found, (first.to_vec(), line), "{text:?}"),
                (None, Err(e)) => assert!(e.to_string().contains(&format!("line {line}")), "{e}"),
                (_, found) => panic!("{text:?}: {found:?}"),
            }
        }
        for text in ["", "\n\n"] {
            let source = Box::new(std::io::Cursor::new(text));
            let found = NumberReader::from_source("it".to_owned(), source, Some(&["t"]));
            assert!(found.is_err_and(|e| e.to_string().contains("no rows")));
        }
    }
}
