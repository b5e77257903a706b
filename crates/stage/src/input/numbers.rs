//! Tables of numbers as CSV: a header line, then one row of finite numbers on each line.

use crate::input::file_plan::FilePlan;
use anyhow::{Context, anyhow, ensure};
use hwall_files::{Row, Table, TableError};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

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
    pub fn open(&self) -> anyhow::Result<(String, Box<dyn BufRead>)> {
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
pub struct NumberReader<R = Box<dyn BufRead>> {
    name: String,
    table: Table<R>,
}

impl NumberReader {
    /// Opens a file, or standard input for `None`.
    ///
    /// # Errors
    /// A file that cannot be opened, or input without a header line.
    pub fn open(path: Option<&Path>) -> anyhow::Result<Self> {
        let (name, source) = source(path)?;
        let table = Table::new(source).map_err(|error| refused(&name, error))?;
        Ok(Self::of(name, table))
    }

    /// As [`open`](Self::open), but the header line may be missing: the columns are then `names`. A first line without
    /// numbers is a header line.
    ///
    /// # Errors
    /// A file that cannot be opened, or input without any line.
    pub fn open_or(path: Option<&Path>, names: &[&str]) -> anyhow::Result<Self> {
        let (name, source) = source(path)?;
        let table = Table::with_names(source, names).map_err(|error| refused(&name, error))?;
        Ok(Self::of(name, table))
    }
}

impl<R: BufRead> NumberReader<R> {
    /// A reader of a table; `name` is for errors.
    pub const fn of(name: String, table: Table<R>) -> Self {
        Self { name, table }
    }

    /// Does the header hold this column?
    #[must_use]
    pub fn has(&self, column: &str) -> bool {
        self.header().iter().any(|h| h == column)
    }

    /// The names of the columns, in their order.
    #[must_use]
    pub fn header(&self) -> &[String] {
        self.table.header()
    }

    /// Indices of the columns.
    ///
    /// # Errors
    /// A column that is missing or that appears twice.
    pub fn columns(&self, names: &[String]) -> anyhow::Result<Vec<usize>> {
        let (header, of) = (self.header(), &self.name);
        let place = |name: &String| {
            let mut places = (0..header.len()).filter(|&i| header[i] == *name);
            let first = places.next().with_context(|| {
                let header = header.join(",");
                format!("{of}: no column {name:?} in the header {header:?}")
            })?;
            ensure!(
                places.next().is_none(),
                "{of}: column {name:?} appears twice"
            );
            Ok(first)
        };
        names.iter().map(place).collect()
    }

    /// The next row, or `None` at the end.
    ///
    /// # Errors
    /// A row with too few or too many cells, or no text.
    pub fn next_row(&mut self) -> anyhow::Result<Option<Row>> {
        let mut row = Row::default();
        match self.table.next_row(&mut row) {
            Ok(is_row) => Ok(is_row.then_some(row)),
            Err(error @ TableError::CellCount { .. }) => {
                let columns = self.header().join(",");
                Err(anyhow!("{} {error}: {columns}", self.name))
            }
            Err(error) => Err(refused(&self.name, error)),
        }
    }

    /// The finite numbers of a row at the indices from [`columns`](Self::columns).
    ///
    /// # Errors
    /// A cell that is not a finite number.
    pub fn values(&self, row: &Row, places: &[usize]) -> anyhow::Result<Vec<f64>> {
        let value = |&place: &usize| {
            let value = self.number(row, place)?;
            value.ok_or_else(|| self.no_number(row, place))
        };
        places.iter().map(value).collect()
    }

    /// As [`values`](Self::values); an empty cell, `NaN`, `NA` or `N/A` is a missing value.
    ///
    /// # Errors
    /// A cell that is neither missing nor a finite number.
    pub fn values_or_missing(
        &self,
        row: &Row,
        places: &[usize],
    ) -> anyhow::Result<Vec<Option<f64>>> {
        places.iter().map(|&p| self.number(row, p)).collect()
    }

    fn number(&self, row: &Row, place: usize) -> anyhow::Result<Option<f64>> {
        let value = row.number(place);
        value.map_err(|_| self.no_number(row, place))
    }

    fn no_number(&self, row: &Row, place: usize) -> anyhow::Error {
        let (at, text) = (self.place(row), row.cell(place));
        let column = self.header().get(place).map_or("", String::as_str);
        anyhow!("{at}, column {column}: {text:?} is not a finite number")
    }

    /// File and line of a row, for errors.
    #[must_use]
    pub fn place(&self, row: &Row) -> String {
        format!("{} line {}", self.name, row.line())
    }
}

/// A file or standard input, and its name for errors.
fn source(path: Option<&Path>) -> anyhow::Result<(String, Box<dyn BufRead>)> {
    let Some(path) = path else {
        let input = Box::new(std::io::stdin().lock());
        return Ok(("standard input".to_owned(), input));
    };
    let name = path.display().to_string();
    let file = File::open(path).with_context(|| name.clone())?;
    Ok((name, Box::new(BufReader::new(file))))
}

/// The error of a table, with the name of the input.
pub(crate) fn refused(name: &str, error: TableError) -> anyhow::Error {
    match error {
        TableError::Io { kind, message } => {
            anyhow::Error::new(std::io::Error::new(kind, message)).context(name.to_owned())
        }
        TableError::Empty => anyhow!("{name}: {error}"),
        _ => anyhow!("{name} {error}"),
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

/// Exactly `count` finite numbers, separated by commas.
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
/// Text that is not such a count.
pub fn count_within<const LEAST: usize, const MOST: usize>(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|n| (LEAST..=MOST).contains(n));
    count.ok_or_else(|| format!("not a whole number from {LEAST} to {MOST}"))
}

/// A whole number of a command line, from `LEAST` to `MOST`.
///
/// # Errors
/// Text that is not such a number.
pub fn whole_within<const LEAST: u64, const MOST: u64>(text: &str) -> Result<u64, String> {
    let number = text.parse().ok().filter(|n| (LEAST..=MOST).contains(n));
    number.ok_or_else(|| format!("not a whole number from {LEAST} to {MOST}"))
}

/// A number of a command line, finite and above zero.
///
/// # Errors
/// Text that is not such a number.
pub fn positive(text: &str) -> Result<f64, String> {
    let value = text.parse().ok();
    let value = value.filter(|value: &f64| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| "not a number above 0".to_owned())
}

/// A number of a command line, from 0 to `MOST`.
///
/// # Errors
/// Text that is not such a number.
pub fn up_to<const MOST: u32>(text: &str) -> Result<f64, String> {
    let value = text.parse().ok();
    let value = value.filter(|value| (0.0..=f64::from(MOST)).contains(value));
    value.ok_or_else(|| format!("not a number from 0 to {MOST}"))
}

/// `1 reach`, `2 reaches`.
#[must_use]
pub fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reader(text: &str) -> NumberReader<&[u8]> {
        NumberReader::of("it".to_owned(), Table::new(text.as_bytes()).unwrap())
    }

    #[test]
    fn a_short_row_is_named_by_its_line() {
        let text = "a,b\r\n\r\n1,2\r\n3\r\n";
        let mut reader = reader(text);
        reader.next_row().unwrap();
        let error = reader.next_row().map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("line 4: 1 cell,"), "{error}");
    }

    #[test]
    fn a_header_line_may_be_missing() {
        for (text, first, line) in [
            ("t,f\n1,2\n3,4\n", Some([1.0, 2.0]), 2),
            ("f,t\r\n\r\n2,1\r\n", Some([1.0, 2.0]), 3),
            ("1,2\n3,4\n", Some([1.0, 2.0]), 1),
            ("\n\n-1e-3,2\n", Some([-1e-3, 2.0]), 3),
            ("\u{feff}1,2\n", Some([1.0, 2.0]), 1),
            // A partial header is a bad row.
            ("t,2\n3,4\n", None, 1),
            ("nan,nan\n", None, 1),
            ("1\n2\n", None, 1),
            ("1,2,3\n", None, 1),
            ("1,2\n3\n", Some([1.0, 2.0]), 1),
        ] {
            let names = ["t", "f"];
            let table = Table::with_names(text.as_bytes(), &names).unwrap();
            let mut reader = NumberReader::of("it".to_owned(), table);
            let places = reader.columns(&names.map(String::from)).unwrap();
            let row = reader.next_row().map(|row| row.unwrap());
            let found = row.and_then(|row| Ok((reader.values(&row, &places)?, row.line())));
            match (first, found) {
                (Some(first), Ok(found)) => assert_eq!(found, (first.to_vec(), line), "{text:?}"),
                (None, Err(e)) => assert!(e.to_string().contains(&format!("line {line}")), "{e}"),
                (_, found) => panic!("{text:?}: {found:?}"),
            }
        }
        for text in ["", "\n\n"] {
            let found = Table::with_names(text.as_bytes(), &["t"]).map(|_| ());
            assert_eq!(found, Err(TableError::Empty));
        }
    }
}
