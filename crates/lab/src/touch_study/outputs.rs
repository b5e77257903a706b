//! Tables, report and figures of a study, beside its log.

use super::figures;
use crate::psychophysics::figures as answers;
use anyhow::Context;
use hwall_psychophysics::Normalisation;
use hwall_study::{Procedure, Protocol, StudyReport, TrialRecord, write_attempts, write_trials};
use std::path::Path;

/// Writes `trials.csv`, `attempts.csv`, `report.md` and the figures, each whole or not at all; returns the report's text.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn write(
    folder: &Path,
    protocol: &Protocol,
    records: &[TrialRecord],
    remarks: &str,
) -> anyhow::Result<String> {
    let report = StudyReport::of(protocol, records)?;
    let (mut trials, mut attempts) = (Vec::new(), Vec::new());
    write_trials(protocol, records, &mut trials)?;
    write_attempts(protocol, records, &mut attempts)?;
    let mut shown = vec![("rendered.svg", "What was wanted beside what was rendered")];
    figures::rendered(&folder.join("rendered.svg"), records)?;
    if let Some(table) = &report.table {
        let how = match protocol.procedure {
            Procedure::Magnitude => Normalisation::Geometric,
            _ => Normalisation::None,
        };
        let table = table.normalise(how)?;
        answers::means(&folder.join("means.svg"), &table, 0.95)?;
        answers::boxes(&folder.join("boxes.svg"), &table)?;
        shown.push(("means.svg", "Mean answers with intervals within subjects"));
        shown.push(("boxes.svg", "Answers of the subjects"));
    }
    let text = report.to_markdown(&shown) + remarks;
    for (name, bytes) in [
        ("trials.csv", trials),
        ("attempts.csv", attempts),
        ("report.md", text.clone().into_bytes()),
    ] {
        let path = folder.join(name);
        hwall_files::write(&path, bytes).with_context(|| path.display().to_string())?;
    }
    Ok(text)
}
