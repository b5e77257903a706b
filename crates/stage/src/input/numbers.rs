//! Tables of numbers as CSV: a header line, then one row of finite numbers a line.

use anyhow::{Context, anyhow, bail};
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::Path;

/// Reads rows by column name, naming line and column of whatever is wrong.
pub struct NumberReader {
    name: String,
    header: Vec<String>,
    records: csv::StringRecordsIntoIter<Box<dyn Read>>,
}

/// One row, and where it stood.
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
        let (name, source): (_, Box<dyn Read>) = match path {
            Some(path) => {
                let file = File::open(path).with_context(|| path.display().to_string())?;
                (path.display().to_string(), Box::new(BufReader::new(file)))
            }
            None => (
                "standard input".to_owned(),
                Box::new(std::io::stdin().lock()),
            ),
        };
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(source);
        let header: Vec<String> = reader
            .headers()
            .with_context(|| name.clone())?
            .iter()
            .map(|h| h.trim_start_matches('\u{feff}').to_owned())
            .collect();
        if header.iter().all(String::is_empty) {
            bail!("{name}: no header line");
        }
        Ok(Self {
            name,
            header,
            records: reader.into_records(),
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
    /// A column that is missing or stands twice.
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
                    bail!("{}: column {name:?} stands twice", self.name);
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
                let line = cells.position().map_or(0, csv::Position::line);
                Ok(Some(NumberRow { line, cells }))
            }
        }
    }

    fn refused(&self, error: csv::Error) -> anyhow::Error {
        let line = error.position().map_or(0, csv::Position::line);
        match *error.kind() {
            csv::ErrorKind::UnequalLengths {
                expected_len, len, ..
            } => anyhow!(
                "{} line {line}: {len} cells, the header has {expected_len}",
                self.name
            ),
            _ => anyhow::Error::new(error).context(self.name.clone()),
        }
    }

    /// The finite numbers of a row at the places that [`columns`](Self::columns) gave.
    ///
    /// # Errors
    /// A cell that is no finite number.
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
                "{} line {}, column {column}: {text:?} is no finite number",
                self.name, row.line
            )
        })
    }

    /// Says where a row stood, for errors about what it means.
    #[must_use]
    pub fn place(&self, row: &NumberRow) -> String {
        format!("{} line {}", self.name, row.line)
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

/// A CSV writer to a file, or to standard output for `None`.
///
/// # Errors
/// A file that cannot be made.
pub fn writer(path: Option<&Path>) -> anyhow::Result<csv::Writer<Box<dyn Write>>> {
    Ok(csv::Writer::from_writer(output(path)?))
}

/// A file, or standard output for `None`, buffered.
///
/// # Errors
/// A file that cannot be created.
pub fn output(path: Option<&Path>) -> anyhow::Result<Box<dyn Write>> {
    let sink: Box<dyn Write> = match path {
        Some(path) => Box::new(File::create(path).with_context(|| path.display().to_string())?),
        None => Box::new(std::io::stdout().lock()),
    };
    Ok(Box::new(BufWriter::new(sink)))
}

/// Numbers in the shortest form that reads back to the same bits.
pub fn to_cells(values: impl IntoIterator<Item = f64>) -> impl Iterator<Item = String> {
    values.into_iter().map(|v| v.to_string())
}
/// `1 reach`, `2 reaches`.
#[must_use]
pub fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}
