//! Tables, report and figures of a study, beside its log.

use super::figures;
use crate::documents::quoted;
use crate::psychophysics::figures as answers;
use anyhow::Context;
use hwall_psychophysics::Normalisation;
use hwall_study::{Procedure, StudyRecord, StudyReport, write_attempts, write_trials};
use std::path::Path;

/// Writes `trials.csv`, `attempts.csv`, `report.md` and the figures, each whole or not at all; returns the report's text.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn write(folder: &Path, study: &StudyRecord, remarks: &str) -> anyhow::Result<String> {
    tables(folder, study)?;
    let report = StudyReport::of(study)?;
    let mut shown = vec![("rendered.svg", "What was wanted beside what was rendered")];
    figures::rendered(&folder.join("rendered.svg"), &study.trials)?;
    if let Some(table) = &report.table {
        let how = match study.protocol.procedure {
            Procedure::Magnitude => Normalisation::Geometric,
            _ => Normalisation::None,
        };
        let table = table.normalise(how)?;
        answers::means(&folder.join("means.svg"), &table, 0.95)?;
        answers::boxes(&folder.join("boxes.svg"), &table)?;
        shown.push(("means.svg", "Mean answers with intervals within subjects"));
        shown.push(("boxes.svg", "Answers of the subjects"));
    }
    let mut text = report.to_markdown(&shown) + remarks;
    if report.table.is_some() {
        text += &again(folder, study, !report.left_out.is_empty());
    }
    put(folder, "report.md", text.clone().into_bytes())?;
    Ok(text)
}

/// Writes `trials.csv` and `attempts.csv` as the study stands.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn tables(folder: &Path, study: &StudyRecord) -> anyhow::Result<()> {
    let (mut trials, mut attempts) = (Vec::new(), Vec::new());
    write_trials(&study.protocol, &study.trials, &mut trials)?;
    write_attempts(&study.protocol, &study.trials, &mut attempts)?;
    put(folder, "trials.csv", trials)?;
    put(folder, "attempts.csv", attempts)
}

fn put(folder: &Path, name: &str, bytes: Vec<u8>) -> anyhow::Result<()> {
    let path = folder.join(name);
    hwall_files::write(&path, bytes).with_context(|| path.display().to_string())
}

/// Heading of what is said about the table.
const AGAIN: &str = "## The same analysis from the table";

/// A report without what only its folder holds: figures, and the command that reads its table.
pub(super) fn without_files(report: &str) -> String {
    let mut about_table = false;
    let kept = report.lines().filter(|line| {
        if line.starts_with("## ") {
            about_table = *line == AGAIN;
        }
        !about_table && !line.starts_with("![")
    });
    kept.fold(String::new(), |text, line| text + line + "\n")
}

/// The command that makes the same analysis from the table.
fn again(folder: &Path, study: &StudyRecord, incomplete: bool) -> String {
    let varied = study.protocol.factors.iter().filter(|f| f.levels.len() > 1);
    let factors: Vec<&str> = varied.map(|f| f.name.as_str()).collect();
    let scale = match study.protocol.procedure {
        Procedure::Magnitude => "geometric",
        _ => "none",
    };
    let missing = if incomplete {
        " --missing complete"
    } else {
        ""
    };
    format!(
        "\n{AGAIN}\n\n```sh\ncargo run --release --example psychophysics -- analyse {} \
         --subject subject --factors {} --value answer --round block --normalise {scale} --errors both --art --posthoc holm{missing}\n```\n",
        quoted(&folder.join("trials.csv").display().to_string()),
        factors.join(",")
    )
}
