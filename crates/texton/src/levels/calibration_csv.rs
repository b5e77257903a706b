//! The table of a study as CSV.

use super::level::Level;
use crate::error::{Result, TextonError};
use crate::geometry::ScanAngle;
use hwall_files::{Row, Table};
use std::io::{BufReader, Read};

const COLUMNS: [&str; 3] = ["orientation_deg", "velocity_mm_s", "value"];

/// The rows of a CSV as levels, in its order.
pub(super) fn read(csv: impl Read) -> Result<Vec<Level>> {
    let mut table = Table::new(BufReader::new(csv))?;
    let mut places = [0; 3];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        let mut names = table.header().iter();
        *place = names
            .position(|name| name == column)
            .ok_or(TextonError::MissingColumn { column })?;
    }
    let mut rows = Vec::new();
    let mut row = Row::default();
    while table.next_row(&mut row)? {
        let number = |i: usize| match row.number(places[i]) {
            Ok(Some(value)) if i != 1 || value >= 0.0 => Ok(value),
            _ => Err(TextonError::Cell {
                line: row.line(),
                column: COLUMNS[i],
                text: row.cell(places[i]).chars().take(40).collect(),
            }),
        };
        rows.push(Level {
            scan: ScanAngle::from_deg(number(0)?)?,
            speed_mm_per_s: number(1)?,
            magnitude: number(2)?,
        });
    }
    Ok(rows)
}
