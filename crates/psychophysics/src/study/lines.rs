//! Line numbers of the records of a text.

use crate::error::PsychophysicsError;

/// Counts lines as editors do; the reader's own count is wrong after CRLF and empty lines.
pub(super) struct LineCounter<'a> {
    text: &'a [u8],
    byte: usize,
    line: u64,
}

impl<'a> LineCounter<'a> {
    pub(super) const fn of(text: &'a [u8]) -> Self {
        let (byte, line) = (0, 1);
        Self { text, byte, line }
    }

    /// Line of a record; to be called in the order of the records.
    pub(super) fn at(&mut self, position: Option<&csv::Position>) -> u64 {
        let start = position.map_or(0, |p| p.byte() as usize);
        while let Some(&byte) = self.text.get(self.byte) {
            let ends = matches!(byte, b'\r' | b'\n');
            if self.byte >= start && !ends {
                break;
            }
            let halfway = byte == b'\r' && self.text.get(self.byte + 1) == Some(&b'\n');
            self.line += u64::from(ends && !halfway);
            self.byte += 1;
        }
        self.line
    }

    /// The error of the reader, with its line.
    pub(super) fn refused(&mut self, error: &csv::Error) -> PsychophysicsError {
        let line = self.at(error.position());
        match error.kind() {
            csv::ErrorKind::UnequalLengths {
                expected_len, len, ..
            } => PsychophysicsError::CellCount {
                line,
                got: *len,
                expected: *expected_len,
            },
            csv::ErrorKind::Utf8 { .. } => PsychophysicsError::Malformed {
                line,
                message: "not UTF-8 text".to_owned(),
            },
            _ => PsychophysicsError::Malformed {
                line,
                message: error.to_string(),
            },
        }
    }
}
