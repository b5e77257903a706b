//! The table of a study as CSV.

use super::level::Level;
use crate::error::TextonError;
use crate::geometry::ScanAngle;
use std::io::Read;

const COLUMNS: [&str; 3] = ["orientation_deg", "velocity_mm_s", "value"];

/// The rows of a CSV as levels, in its order.
pub(super) fn read(mut csv: impl Read) -> Result<Vec<Level>, TextonError> {
    let mut bytes = Vec::new();
    csv.read_to_end(&mut bytes)
        .map_err(|error| TextonError::file("calibration table", error.kind(), error))?;
    // A spreadsheet may have put a byte order mark before the first name.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    let broken = |error: csv::Error| TextonError::BrokenLine {
        line: error.position().map_or(0, |at| line(bytes, at)),
    };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(bytes);
    let header = reader.headers().map_err(broken)?.clone();
    let mut places = [0; 3];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        let named = |name: &str| name == column;
        *place = header
            .iter()
            .position(named)
            .ok_or(TextonError::MissingColumn { column })?;
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let number = |i: usize| {
            let text = record.get(places[i]).unwrap_or_default();
            let cell = || TextonError::Cell {
                line: record.position().map_or(0, |at| line(bytes, at)),
                column: COLUMNS[i],
                text: text.chars().take(40).collect(),
            };
            let value: f64 = text.parse().map_err(|_| cell())?;
            let allowed = value.is_finite() && (i != 1 || value >= 0.0);
            if allowed { Ok(value) } else { Err(cell()) }
        };
        rows.push(Level {
            scan: ScanAngle::from_deg(number(0)?)?,
            speed_mm_per_s: number(1)?,
            magnitude: number(2)?,
        });
    }
    Ok(rows)
}

/// The line of a record, from 1. The reader's own count leaves out blank lines before the record, and
/// is off after `\r\n`.
fn line(bytes: &[u8], at: &csv::Position) -> u64 {
    let ends = |byte: &u8| matches!(byte, b'\r' | b'\n');
    let at = usize::try_from(at.byte()).map_or(bytes.len(), |at| at.min(bytes.len()));
    let blank = bytes[at..].iter().take_while(|byte| ends(byte)).count();
    let before = at + blank;
    let ended = (0..before).filter(|&i| {
        let pair = bytes[i] == b'\r' && bytes.get(i + 1) == Some(&b'\n');
        ends(&bytes[i]) && !pair
    });
    1 + ended.count() as u64
}
