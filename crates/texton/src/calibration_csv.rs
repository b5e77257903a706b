//! A study's own table as a calibration.

use crate::{Calibration, ScanAngle, TextonError};
use std::io::Read;

/// Orientation, speed (mm/s), magnitude.
pub(crate) type Row = (ScanAngle, f64, f64);

const COLUMNS: [&str; 3] = ["orientation_deg", "velocity_mm_s", "value"];

impl Calibration {
    /// From a CSV with a header that names at least `orientation_deg`, `velocity_mm_s` and `value`, in any
    /// order; rows in any order, those of one condition (subjects, rounds) averaged.
    ///
    /// # Errors
    /// A missing column; a line that cannot be read, with its number; as [`Calibration::from_rows`].
    pub fn from_csv(csv: impl Read) -> Result<Self, TextonError> {
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(csv);
        let header = reader.headers().map_err(|error| broken(&error))?.clone();
        let mut places = [0; 3];
        for (place, column) in places.iter_mut().zip(COLUMNS) {
            // A spreadsheet may have put a byte order mark before the first name.
            let named = |name: &str| name.trim_start_matches('\u{feff}') == column;
            *place = header
                .iter()
                .position(named)
                .ok_or(TextonError::MissingColumn { column })?;
        }
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| broken(&error))?;
            let line = record.position().map_or(0, csv::Position::line);
            let number = |i: usize| {
                let text = record.get(places[i]).unwrap_or_default();
                let cell = || TextonError::Cell {
                    line,
                    column: COLUMNS[i],
                    text: text.to_owned(),
                };
                let value: f64 = text.parse().map_err(|_| cell())?;
                let allowed = value.is_finite() && (i != 1 || value >= 0.0);
                if allowed { Ok(value) } else { Err(cell()) }
            };
            rows.push((ScanAngle::from_deg(number(0)?)?, number(1)?, number(2)?));
        }
        Self::from_rows(rows)
    }
}

fn broken(error: &csv::Error) -> TextonError {
    TextonError::BrokenLine {
        line: error.position().map_or(0, csv::Position::line),
    }
}
