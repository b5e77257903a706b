//! Reading a study from a wide table: one row per subject, one column per combination of levels.

use super::complete::Study;
use super::table::Columns;
use crate::error::PsychophysicsError;

impl Study {
    /// Reads a wide table: a header line, then one row per subject. The columns of answers are named by the levels of the
    /// factors of `columns` in their order, joined by `joint`: `0_20`, `0_40`, `45_20` for the factors angle and speed and
    /// the joint `_`. Other columns are ignored; [`Columns::value`] is only what the answers are called.
    ///
    /// # Errors
    /// As [`Study::from_csv_str`]; no column of answers; rounds, which a wide table does not have.
    pub fn from_wide_csv_str(
        text: &str,
        columns: &Columns,
        joint: &str,
    ) -> Result<Self, PsychophysicsError> {
        let refused = |why: &'static str| PsychophysicsError::Wide { why };
        if !columns.rounds.is_empty() {
            return Err(refused("it has no rounds"));
        }
        if joint.is_empty() && columns.within.len() > 1 {
            return Err(refused("levels need a text that joins them"));
        }
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let delimiter = super::table::delimiter_of(text.as_bytes());
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .delimiter(delimiter)
            .from_reader(text.as_bytes());
        let malformed = |error: csv::Error| PsychophysicsError::Malformed {
            line: error.position().map_or(0, csv::Position::line),
            message: error.to_string(),
        };
        let header = reader.headers().map_err(malformed)?.clone();
        let named = [Some(&columns.subject), columns.between.as_ref()];
        let kept = |name: &str| named.iter().flatten().any(|n| n.eq_ignore_ascii_case(name));
        let levels: Vec<Option<Vec<&str>>> = header
            .iter()
            .map(|name| {
                let parts: Vec<&str> = match columns.within.len() {
                    1 => vec![name],
                    _ => name.split(joint).collect(),
                };
                let fits =
                    parts.len() == columns.within.len() && parts.iter().all(|p| !p.is_empty());
                (fits && !kept(name)).then_some(parts)
            })
            .collect();
        if levels.iter().all(Option::is_none) {
            return Err(refused("no column is named by a level of every factor"));
        }
        let mut long = csv::Writer::from_writer(Vec::new());
        let mut head: Vec<&str> = named.iter().flatten().map(|n| n.as_str()).collect();
        head.extend(columns.within.iter().map(String::as_str));
        head.push(&columns.value);
        long.write_record(&head).map_err(malformed)?;
        let places: Vec<usize> = named
            .iter()
            .flatten()
            .map(|name| {
                let found = header.iter().position(|h| h.eq_ignore_ascii_case(name));
                found.ok_or_else(|| PsychophysicsError::UnknownColumn {
                    column: (*name).clone(),
                    header: header.iter().collect::<Vec<_>>().join(","),
                })
            })
            .collect::<Result<_, _>>()?;
        for record in reader.records() {
            let record = record.map_err(malformed)?;
            for (cell, levels) in record.iter().zip(&levels) {
                let Some(levels) = levels else {
                    continue;
                };
                let mut row: Vec<&str> = places.iter().filter_map(|p| record.get(*p)).collect();
                row.extend(levels);
                row.push(cell);
                long.write_record(&row).map_err(malformed)?;
            }
        }
        let bytes = long.into_inner().map_err(|_| refused("it is too large"))?;
        let decimal_commas = delimiter != b',';
        Self::read_long(&bytes, columns, decimal_commas)
    }
}
