//! Tables, report and figures of a study, in the folder of its log.

use super::thesis;
use crate::documents::quoted;
use crate::psychophysics::figures as answers;
use anyhow::Context;
use hwall_psychophysics::{Normalisation, Study};
use hwall_stage::figures::COLOURS;
use hwall_stage::report::figure::{Axes, Draw, Mesh, Plot, figure};
use hwall_study::{
    Procedure, StudyRecord, StudyReport, TrialKind, TrialRecord, write_attempts, write_trials,
};
use plotters::prelude::*;
use std::path::Path;

/// Writes `trials.csv`, `attempts.csv`, `report.md` and the figures, each atomically; returns the report's text.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn write(folder: &Path, study: &StudyRecord, remarks: &str) -> anyhow::Result<String> {
    tables(folder, study)?;
    let report = StudyReport::of(study)?;
    let shown = figures(folder, study, &report)?;
    let mut text = report.to_markdown(&shown) + remarks + &thesis::section(study);
    if report.table.is_some() {
        text += &again(folder, study, !report.left_out.is_empty());
    }
    put(folder, "report.md", text.clone().into_bytes())?;
    Ok(text)
}

/// Draws the figures of a study into a folder; returns their file names and captions.
///
/// # Errors
/// A file that cannot be written.
pub fn figures(
    folder: &Path,
    study: &StudyRecord,
    report: &StudyReport,
) -> anyhow::Result<Vec<(&'static str, &'static str)>> {
    let mut shown = vec![("rendered.svg", "What was wanted beside what was rendered")];
    rendered(&folder.join("rendered.svg"), &study.trials)?;
    if let Some(table) = normalised(study, report)? {
        answers::means(&folder.join("means.svg"), &table, 0.95)?;
        answers::boxes(&folder.join("boxes.svg"), &table)?;
        shown.push(("means.svg", "Mean answers with intervals within subjects"));
        shown.push(("boxes.svg", "Answers of the subjects"));
    }
    Ok(shown)
}

/// The answers of a study, magnitudes normalised; `None` if there are too few.
///
/// # Errors
/// Answers that cannot be normalised.
pub(crate) fn normalised(
    study: &StudyRecord,
    report: &StudyReport,
) -> anyhow::Result<Option<Study>> {
    let how = match study.protocol.procedure {
        Procedure::Magnitude => Normalisation::Geometric,
        _ => Normalisation::None,
    };
    let table = report.table.as_ref();
    Ok(table.map(|table| table.normalise(how)).transpose()?)
}

/// Writes `trials.csv` and `attempts.csv` of the study so far.
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

/// Heading of the section about the table.
const AGAIN: &str = "## The same analysis from the table";

/// A report without the parts that refer to files in its folder: figures, and the command that reads its table.
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

/// The command for the same analysis from the table.
fn again(folder: &Path, study: &StudyRecord, incomplete: bool) -> String {
    let varied = study.protocol.factors.iter().filter(|f| f.levels.len() > 1);
    let factors: Vec<&str> = varied.map(|f| f.name.as_str()).collect();
    let scale = match study.protocol.procedure {
        Procedure::Magnitude => "geometric",
        _ => "none",
    };
    let missing = match incomplete {
        true => " --missing complete",
        false => "",
    };
    format!(
        "\n{AGAIN}\n\n```sh\ncargo run --release --example psychophysics -- analyse {} \
         --subject subject --factors {} --value answer --round block --normalise {scale} --errors both --art --posthoc holm{missing}\n```\n",
        quoted(&folder.join("trials.csv").display().to_string()),
        factors.join(",")
    )
}

/// Angle and speed of every valid main trial: rendered minus wanted, over wanted.
///
/// # Errors
/// A file that cannot be written.
fn rendered(path: &Path, records: &[TrialRecord]) -> anyhow::Result<()> {
    let counts = |r: &&TrialRecord| r.is_valid() && r.trial.kind == TrialKind::Main;
    // Wanted value, and its error.
    let points = |of: fn(&TrialRecord) -> Option<[f64; 2]>| -> Vec<(f64, f64)> {
        let pairs = records.iter().filter(counts).filter_map(of);
        pairs.map(|[wanted, is]| (wanted, is - wanted)).collect()
    };
    let angles = points(|r| Some([r.wanted.angle_deg, r.shown.rendered.angle_deg?]));
    let speeds = points(|r| Some([r.wanted.speed_mm_per_s, r.shown.rendered.speed_mm_per_s?]));
    let panels = [
        (angles, ["wanted angle, degrees", "off by, degrees"], 95.0),
        (speeds, ["wanted speed, mm/s", "off by, mm/s"], 105.0),
    ];
    figure(path, (900, 420), |root| {
        let areas = root.below("Rendered less wanted, each trial that counts")?;
        let areas = areas.split_evenly((1, 2));
        for ((points, names, most), area) in panels.into_iter().zip(areas) {
            let most = points.iter().map(|p| 1.05 * p.0).fold(most, f64::max);
            let largest = points.iter().map(|p| p.1.abs()).fold(0.1, f64::max);
            let axes = Axes {
                names,
                numbers: [Some(6), None],
                labels: [64, 46],
                margin: 12,
                mesh: Mesh::Single,
                ..Axes::default()
            };
            let mut chart = axes.on(&area, -5.0..most, -1.15 * largest..1.15 * largest)?;
            let dot = COLOURS[0].mix(0.5).filled();
            chart.series(points.into_iter().map(|at| Circle::new(at, 3, dot)))?;
        }
        Ok(())
    })
}
