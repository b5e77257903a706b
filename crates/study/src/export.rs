//! Tables of a study, as CSV.

use crate::error::StudyError;
use crate::protocol::{Protocol, TrialKind};
use crate::run::TrialRecord;
use std::io::Write;

/// Columns after those of the factors.
const COLUMNS: [&str; 12] = [
    "wanted_angle_deg",
    "wanted_speed_mm_per_s",
    "rendered_angle_deg",
    "rendered_speed_mm_per_s",
    "rendered_felt_mm_per_s",
    "rendered_force_n",
    "rendered_contact_s",
    "rendered_moved",
    "answer",
    "answered_s",
    "valid",
    "why_not",
];

/// The long table that `psychophysics analyse` reads: one row per trial of the study, with its last attempt. Without practice
/// and catch trials.
///
/// # Errors
/// An output that cannot be written.
pub fn write_trials(
    protocol: &Protocol,
    records: &[TrialRecord],
    output: impl Write,
) -> Result<(), StudyError> {
    let mut last: Vec<&TrialRecord> = Vec::new();
    let mut place = std::collections::HashMap::new();
    for record in records.iter().filter(|r| r.trial.kind == TrialKind::Main) {
        let key = (record.subject, record.trial.number);
        match place.get(&key).and_then(|at: &usize| last.get_mut(*at)) {
            Some(earlier) => *earlier = record,
            None => {
                place.insert(key, last.len());
                last.push(record);
            }
        }
    }
    table(protocol, last.into_iter(), false, output)
}

/// Every attempt, including practice and catch trials, in chronological order.
///
/// # Errors
/// An output that cannot be written.
pub fn write_attempts(
    protocol: &Protocol,
    records: &[TrialRecord],
    output: impl Write,
) -> Result<(), StudyError> {
    table(protocol, records.iter(), true, output)
}

/// One row per record; `attempts`: adds the kind of trial and the number of the attempt.
fn table<'a>(
    protocol: &Protocol,
    records: impl Iterator<Item = &'a TrialRecord>,
    attempts: bool,
    output: impl Write,
) -> Result<(), StudyError> {
    let of_attempts = if attempts {
        &["kind", "attempt"][..]
    } else {
        &[]
    };
    let names = protocol.factors.iter().map(|f| f.name.as_str());
    let header = ["subject", "trial", "block"].into_iter().chain(names);
    let header = header.chain(of_attempts.iter().copied()).chain(COLUMNS);
    let mut writer = csv::Writer::from_writer(output);
    writer.write_record(header).map_err(failed)?;
    for record in records {
        let mut row = vec![
            protocol.pseudonym(record.subject),
            record.trial.number.to_string(),
            record.trial.block.to_string(),
        ];
        let levels = protocol.levels(record.trial.condition);
        row.extend(levels.into_iter().flatten().map(str::to_owned));
        if attempts {
            let kind = match record.trial.kind {
                TrialKind::Practice => "practice",
                TrialKind::Main => "main",
                TrialKind::Catch => "catch",
            };
            row.extend([kind.to_owned(), record.attempt.to_string()]);
        }
        row.extend(cells(record));
        writer.write_record(row).map_err(failed)?;
    }
    writer.flush().map_err(|error| failed(error.into()))
}

fn cells(record: &TrialRecord) -> Vec<String> {
    let number = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
    let rendered = &record.shown.rendered;
    vec![
        record.wanted.angle_deg.to_string(),
        record.wanted.speed_mm_per_s.to_string(),
        number(rendered.angle_deg),
        number(rendered.speed_mm_per_s),
        number(rendered.felt_mm_per_s),
        number(rendered.force_n),
        rendered.contact_s.to_string(),
        number(rendered.moved),
        number(record.answer),
        record.answered_s.to_string(),
        record.is_valid().to_string(),
        record.why_not.clone().unwrap_or_default(),
    ]
}

fn failed(error: csv::Error) -> StudyError {
    let kind = match error.kind() {
        csv::ErrorKind::Io(error) => error.kind(),
        _ => std::io::ErrorKind::InvalidData,
    };
    StudyError::File {
        name: "table of trials".to_owned(),
        kind,
        message: error.to_string(),
    }
}
