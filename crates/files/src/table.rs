//! Tables of text, as written by programs and spreadsheets of any locale.

use std::borrow::Cow;
use std::io::{self, BufRead};

/// Largest number of cells per line: a hundred times that of a recording of both hands and the body.
const MOST_CELLS: usize = 10_000;

/// Why a table cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The source fails.
    #[error("{message}")]
    Io {
        /// Kind of failure.
        kind: io::ErrorKind,
        /// The message of the operating system.
        message: String,
    },
    /// All lines are blank.
    #[error("empty: no header line")]
    Empty,
    /// A row with more or fewer cells than there are columns.
    #[error("line {line}: {got} cell{}, the header has {expected}", if *got == 1 { "" } else { "s" })]
    CellCount {
        /// The line, from 1.
        line: u64,
        /// Cells of the row.
        got: usize,
        /// Columns.
        expected: usize,
    },
    /// More cells than any table here has; limits memory.
    #[error("line {line}: {got} cells, at most {most} are read")]
    TooManyCells {
        /// The line, from 1.
        line: u64,
        /// Cells of the line.
        got: usize,
        /// The most.
        most: usize,
    },
    /// A line with a zero byte: UTF-16, or not text at all.
    #[error("line {line}: not text; save the table as UTF-8")]
    NotText {
        /// The line, from 1.
        line: u64,
    },
    /// A quoted cell that does not end.
    #[error("line {line}: a quoted cell does not end")]
    OpenQuote {
        /// The line on which its row begins, from 1.
        line: u64,
    },
}

/// One row: its cells without spaces around them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Row {
    line: u64,
    text: String,
    /// Where each cell ends in the text.
    ends: Vec<usize>,
    /// Number of cells beyond the limit, which are not kept.
    beyond: usize,
    decimal_commas: bool,
}

impl Row {
    /// The line on which the row begins, from 1, as in editors.
    #[must_use]
    pub const fn line(&self) -> u64 {
        self.line
    }

    /// A cell; empty beyond the last.
    #[must_use]
    pub fn cell(&self, place: usize) -> &str {
        let end = |i: usize| self.ends.get(i).copied().unwrap_or(self.text.len());
        &self.text[if place == 0 { 0 } else { end(place - 1) }..end(place)]
    }

    /// All cells.
    pub fn cells(&self) -> impl Iterator<Item = &str> {
        (0..self.ends.len()).map(|i| self.cell(i))
    }

    /// The number of a cell; `None` for a missing one: an empty cell, `NaN`, `NA` or `N/A`.
    ///
    /// # Errors
    /// A cell that is not a finite number; returns its text.
    pub fn number(&self, place: usize) -> Result<Option<f64>, &str> {
        let text = self.cell(place);
        number(text, self.decimal_commas).map_err(|()| text)
    }

    fn begin(&mut self, line: u64, separator: char) {
        self.line = line;
        self.decimal_commas = separator != ',';
        self.text.clear();
        self.ends.clear();
        self.beyond = 0;
    }

    fn end_cell(&mut self) {
        let start = self.ends.last().copied().unwrap_or(0);
        let cell = self.text[start..].trim_end().len();
        self.text.truncate(start + cell);
        let blank = cell - self.text[start..].trim_start().len();
        self.text.drain(start..start + blank);
        if self.ends.len() < MOST_CELLS {
            self.ends.push(self.text.len());
        } else {
            self.text.truncate(start);
            self.beyond += 1;
        }
    }

    /// Adds a line, starting within quotes or not; returns whether a quoted cell continues on the next line.
    fn take(&mut self, line: &str, separator: char, mut quoted: bool) -> bool {
        if !quoted && !line.contains('"') {
            for cell in line.split(separator) {
                self.text.push_str(cell);
                self.end_cell();
            }
            return false;
        }
        let mut signs = line.chars().peekable();
        while let Some(sign) = signs.next() {
            let start = self.ends.last().copied().unwrap_or(0);
            match sign {
                '"' if quoted && signs.next_if_eq(&'"').is_some() => self.text.push('"'),
                '"' if quoted => quoted = false,
                '"' if self.text[start..].trim().is_empty() => quoted = true,
                _ if sign == separator && !quoted => self.end_cell(),
                _ => self.text.push(sign),
            }
        }
        if !quoted {
            self.end_cell();
        }
        quoted
    }
}

/// A table, read row by row.
///
/// The text is UTF-8, with or without a byte order mark, else Latin-1. The separator is a comma, semicolon, tab or
/// bar, chosen from the first line; if it is not a comma, `3,5` is a number as well as `3.5`. Lines end with LF,
/// CRLF or CR. Cells may be quoted. Blank lines and empty cells after the last column are ignored.
#[derive(Debug)]
pub struct Table<R> {
    lines: Lines<R>,
    separator: char,
    header: Vec<String>,
    /// The first line, if it is already a row.
    first: Option<Row>,
}

impl<R: BufRead> Table<R> {
    /// A table with a header line.
    ///
    /// # Errors
    /// A source that cannot be read, is empty or is not text; too many columns.
    pub fn new(source: R) -> Result<Self, TableError> {
        let (mut table, first) = Self::begin(source)?;
        table.header = names_of(&first);
        match table.header.is_empty() {
            true => Err(TableError::Empty),
            false => Ok(table),
        }
    }

    /// A table whose header line may be missing: the columns are then `names`. A first line without numbers is a
    /// header line.
    ///
    /// # Errors
    /// As [`Table::new`].
    pub fn with_names(source: R, names: &[&str]) -> Result<Self, TableError> {
        let (mut table, first) = Self::begin(source)?;
        let is_number = |i| !first.cell(i).is_empty() && first.number(i).is_ok();
        let is_row = (0..first.ends.len()).any(is_number);
        if is_row {
            table.header = names.iter().map(|&name| name.to_owned()).collect();
            table.first = Some(first);
        } else {
            table.header = names_of(&first);
        }
        Ok(table)
    }

    fn begin(source: R) -> Result<(Self, Row), TableError> {
        let mut lines = Lines {
            source,
            raw: Vec::new(),
            line: 0,
            after_cr: false,
        };
        let (line, first) = lines.next_used()?.ok_or(TableError::Empty)?;
        let separator = separator_of(&first);
        let mut row = Row::default();
        row.begin(line, separator);
        let open = row.take(&first, separator, false);
        let mut table = Self {
            lines,
            separator,
            header: Vec::new(),
            first: None,
        };
        table.complete(&mut row, open)?;
        Ok((table, row))
    }

    /// The names of the columns, in their order.
    #[must_use]
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// Reads the next row, or returns `false` at the end.
    ///
    /// # Errors
    /// A row with too few or too many cells, a source that cannot be read or is not text.
    pub fn next_row(&mut self, row: &mut Row) -> Result<bool, TableError> {
        if let Some(first) = self.first.take() {
            *row = first;
        } else {
            let Some((line, text)) = self.lines.next_used()? else {
                return Ok(false);
            };
            row.begin(line, self.separator);
            let open = row.take(&text, self.separator, false);
            self.complete(row, open)?;
        }
        let expected = self.header.len();
        while row.ends.len() > expected && row.cell(row.ends.len() - 1).is_empty() {
            row.ends.pop();
        }
        match row.ends.len() {
            got if got == expected => Ok(true),
            got => Err(TableError::CellCount {
                line: row.line,
                got,
                expected,
            }),
        }
    }

    /// Reads the remaining lines of a row with an open quoted cell.
    fn complete(&mut self, row: &mut Row, mut open: bool) -> Result<(), TableError> {
        let line = row.line;
        while open {
            let next = self.lines.next()?.ok_or(TableError::OpenQuote { line })?;
            row.text.push('\n');
            open = row.take(&next.1, self.separator, true);
        }
        match row.beyond {
            0 => Ok(()),
            beyond => Err(TableError::TooManyCells {
                line,
                got: MOST_CELLS + beyond,
                most: MOST_CELLS,
            }),
        }
    }
}

/// The cells of a header line up to the last that is not empty.
fn names_of(header: &Row) -> Vec<String> {
    let mut names: Vec<String> = header.cells().map(str::to_owned).collect();
    while names.last().is_some_and(String::is_empty) {
        names.pop();
    }
    names
}

/// The number of a cell; `None` if it is missing.
fn number(text: &str, decimal_commas: bool) -> Result<Option<f64>, ()> {
    let missing = ["", "nan", "-nan", "na", "n/a"];
    if missing.iter().any(|word| text.eq_ignore_ascii_case(word)) {
        return Ok(None);
    }
    let value = match decimal_commas && !text.contains('.') {
        true => text.replacen(',', ".", 1).parse(),
        false => text.parse(),
    };
    let value = value.ok().filter(|value: &f64| value.is_finite());
    value.map(Some).ok_or(())
}

/// The separator of a first line: the most frequent one outside quotes; ties give the comma.
fn separator_of(line: &str) -> char {
    const SIGNS: [char; 4] = ['|', '\t', ';', ','];
    // Without a header line, decimal commas as in `0,5;1,5` would outnumber the separators.
    let are_numbers = |&sign: &char| {
        let mut cells = line.split(sign);
        line.contains(sign) && cells.all(|cell| number(cell.trim(), true).is_ok())
    };
    if let Some(sign) = SIGNS[..3].iter().copied().find(are_numbers) {
        return sign;
    }
    let unquoted: Vec<&str> = line.split('"').step_by(2).collect();
    let count = |sign: &char| -> usize { unquoted.iter().map(|t| t.matches(*sign).count()).sum() };
    SIGNS.into_iter().max_by_key(count).unwrap_or(',')
}

/// The lines of a source.
#[derive(Debug)]
struct Lines<R> {
    source: R,
    raw: Vec<u8>,
    /// The number of the line that was read last, from 1.
    line: u64,
    after_cr: bool,
}

impl<R: BufRead> Lines<R> {
    /// The next non-blank line, and its number.
    fn next_used(&mut self) -> Result<Option<(u64, Cow<'_, str>)>, TableError> {
        while self.read()? {
            if !self.raw.iter().all(|&byte| byte == b' ') {
                return self.decoded().map(Some);
            }
        }
        Ok(None)
    }

    fn next(&mut self) -> Result<Option<(u64, Cow<'_, str>)>, TableError> {
        match self.read()? {
            true => self.decoded().map(Some),
            false => Ok(None),
        }
    }

    /// Reads a line without its line end; `false` after the last.
    fn read(&mut self) -> Result<bool, TableError> {
        self.raw.clear();
        self.line += 1;
        loop {
            let bytes = match self.source.fill_buf() {
                Ok(bytes) => bytes,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => {
                    let (kind, message) = (error.kind(), error.to_string());
                    return Err(TableError::Io { kind, message });
                }
            };
            let Some(&byte) = bytes.first() else {
                break;
            };
            if std::mem::take(&mut self.after_cr) && byte == b'\n' {
                self.source.consume(1);
                continue;
            }
            let end = bytes.iter().position(|byte| matches!(byte, b'\r' | b'\n'));
            self.raw.extend(&bytes[..end.unwrap_or(bytes.len())]);
            self.after_cr = end.is_some_and(|end| bytes[end] == b'\r');
            let taken = end.map_or(bytes.len(), |end| end + 1);
            self.source.consume(taken);
            if end.is_some() {
                self.without_mark();
                return Ok(true);
            }
        }
        self.without_mark();
        Ok(!self.raw.is_empty())
    }

    fn without_mark(&mut self) {
        if self.line == 1 && self.raw.starts_with(b"\xef\xbb\xbf") {
            self.raw.drain(..3);
        }
    }

    fn decoded(&self) -> Result<(u64, Cow<'_, str>), TableError> {
        if self.raw.contains(&0) {
            return Err(TableError::NotText { line: self.line });
        }
        let latin1 = || self.raw.iter().map(|&byte| char::from(byte)).collect();
        let text = match std::str::from_utf8(&self.raw) {
            Ok(text) => Cow::Borrowed(text),
            Err(_) => Cow::Owned(latin1()),
        };
        Ok((self.line, text))
    }
}
