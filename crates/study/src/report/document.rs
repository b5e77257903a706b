//! The report of a study.

use super::agreement;
use super::effects;
use super::groups::{LevelGroups, level_groups};
use super::methods;
use super::ratings;
use super::scale;
use super::thresholds;
use crate::error::StudyError;
use crate::export::write_trials;
use crate::protocol::{Procedure, Protocol, TrialKind};
use crate::run::{StudyRecord, TrialRecord};
use hwall::psychophysics::{
    Adjustment, Analysis, AnalysisConfig, Columns, ErrorModel, LeftOut, Normalisation,
    Study as Table, analyse,
};
use std::fmt::Write;

/// Pairs with an adjusted p below this differ.
const ALPHA: f64 = 0.05;

/// The analysis of a study, and its report.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyReport {
    /// The analysis of the answers; none if they do not form a complete study.
    pub analysis: Option<Analysis>,
    /// Why there is no analysis.
    pub why_not: Option<String>,
    /// Levels of each factor in groups.
    pub groups: Vec<LevelGroups>,
    /// The analysed table: subjects with a valid answer in every condition.
    pub table: Option<Table>,
    /// Subjects left out of the table.
    pub left_out: Vec<LeftOut>,
    text: String,
}

impl StudyReport {
    /// Analyses the answers so far: magnitudes normalised by geometric means, both error models, pairs by Holm. Subjects without
    /// a valid answer in every cell are left out and named.
    ///
    /// # Errors
    /// A table that cannot be created. Answers that cannot be analysed yet are not an error: the report states why.
    pub fn of(study: &StudyRecord) -> Result<Self, StudyError> {
        let protocol = &study.protocol;
        let table = match protocol.procedure {
            Procedure::MoreReal { .. } => {
                Err("which of two was more real is tested exactly".to_owned())
            }
            other if other.is_two_intervals() => {
                Err("which of two was rougher gives thresholds".to_owned())
            }
            _ => table(protocol, &study.trials)?,
        };
        let config = AnalysisConfig {
            normalisation: match protocol.procedure {
                Procedure::Magnitude => Normalisation::Geometric,
                _ => Normalisation::None,
            },
            errors: vec![ErrorModel::Strata, ErrorModel::Pooled],
            art: true,
            posthoc: Some(Adjustment::Holm),
            confidence: 0.95,
        };
        let mut report = Self {
            analysis: None,
            why_not: None,
            groups: Vec::new(),
            table: None,
            left_out: Vec::new(),
            text: String::new(),
        };
        let analysed = table.and_then(|table| {
            report.left_out = table.left_out().to_vec();
            let analysis = analyse(&table, &config).map_err(|error| error.to_string())?;
            Ok((table, analysis))
        });
        match analysed {
            Ok((table, analysis)) => {
                report.groups = level_groups(&analysis.posthoc, Adjustment::Holm, ALPHA);
                report.analysis = Some(analysis);
                report.table = Some(table);
            }
            Err(why_not) => report.why_not = Some(why_not),
        }
        report.text = report.write(study).unwrap_or_default();
        if let Some(points) = ratings::has_ratings(protocol) {
            report.text += &ratings::section(study, points)?;
        } else if protocol.procedure.is_two_intervals() {
            report.text += "\n## Thresholds\n\n";
            report.text += &thresholds::section(protocol, &study.trials)?;
        }
        Ok(report)
    }

    /// The report in Markdown; `figures`: file names and captions of linked figures.
    #[must_use]
    pub fn to_markdown(&self, figures: &[(&str, &str)]) -> String {
        let mut text = self.text.clone();
        if !figures.is_empty() {
            text += "\n## Figures\n";
        }
        for (file, caption) in figures {
            text += &format!("\n![{caption}]({file})\n");
        }
        if let Some(analysis) = &self.analysis {
            text += "\n";
            text += &analysis
                .to_markdown()
                .replace("\n## ", "\n### ")
                .replacen("# ", "## ", 1);
        }
        text
    }

    fn write(&self, study: &StudyRecord) -> Result<String, std::fmt::Error> {
        let (p, done) = (&study.protocol, &study.trials);
        let mut out = String::new();
        writeln!(out, "# Study: {}\n", p.title)?;
        let main = done.iter().filter(|r| r.trial.kind == TrialKind::Main);
        let valid: Vec<&TrialRecord> = main.filter(|r| r.is_valid()).collect();
        let wanted = p.subjects * p.conditions() * p.repeats;
        writeln!(out, "## Methods\n\n{}", methods::paragraph(study))?;
        writeln!(out, "\n## Trials\n")?;
        let spoilt = done.iter().filter(|r| !r.is_valid()).count();
        writeln!(
            out,
            "{} of {wanted} trials have a valid answer; {} attempts with practice and catch trials, {}.",
            valid.len(),
            done.len(),
            match spoilt {
                0 => "none of them spoilt".to_owned(),
                n => format!("{n} of them spoilt"),
            }
        )?;
        let mut reasons: Vec<(&str, usize)> = Vec::new();
        for why in done.iter().filter_map(|r| r.why_not.as_deref()) {
            match reasons.iter_mut().find(|(reason, _)| *reason == why) {
                Some((_, count)) => *count += 1,
                None => reasons.push((why, 1)),
            }
        }
        for (why, count) in reasons {
            writeln!(out, "- {why}: {count}")?;
        }
        rendered(&mut out, &valid)?;
        out += &agreement::sentence(p.procedure, done);
        if let Procedure::Likert { points } = p.procedure {
            out += &scale::section(p, points, &valid);
        }
        writeln!(out, "\n## Result\n")?;
        if let Some(why_not) = &self.why_not {
            writeln!(out, "No analysis of variance: {why_not}.")?;
        }
        for left_out in &self.left_out {
            writeln!(
                out,
                "{} is left out of the analysis: no valid answer for {} ({} missing).\n",
                left_out.subject, left_out.cell, left_out.missing
            )?;
        }
        if let Some(analysis) = &self.analysis {
            for effect in &analysis.effects {
                writeln!(out, "- {}", effects::sentence(effect))?;
            }
            for warning in &analysis.warnings {
                writeln!(out, "- Warning: {warning}.")?;
            }
            writeln!(
                out,
                "\nLevels from the least mean; levels that share a letter do not differ (paired t, Holm, {ALPHA}):\n"
            )?;
            for groups in &self.groups {
                writeln!(out, "- {}: {}", groups.factor, groups.to_text())?;
            }
        }
        Ok(out)
    }
}

/// Table of wanted and rendered values.
fn rendered(out: &mut String, valid: &[&TrialRecord]) -> std::fmt::Result {
    let spread = |of: &dyn Fn(&TrialRecord) -> Option<f64>| -> Option<[f64; 3]> {
        let mut values: Vec<f64> = valid.iter().filter_map(|r| of(r)).collect();
        values.sort_by(f64::total_cmp);
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let off = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        let sd = (off / (values.len() as f64 - 1.0).max(1.0)).sqrt();
        let largest = values.iter().copied().map(f64::abs).fold(0.0, f64::max);
        (!values.is_empty()).then_some([mean, sd, largest])
    };
    writeln!(
        out,
        "\n| rendered | mean | sd | largest size |\n| --- | --- | --- | --- |"
    )?;
    let angle = |r: &TrialRecord| Some(r.shown.rendered.angle_deg? - r.wanted.angle_deg);
    let speed = |r: &TrialRecord| Some(r.shown.rendered.speed_mm_per_s? - r.wanted.speed_mm_per_s);
    let force = |r: &TrialRecord| r.shown.rendered.force_n;
    let contact = |r: &TrialRecord| Some(r.shown.rendered.contact_s);
    let answered = |r: &TrialRecord| Some(r.answered_s);
    type Of<'a> = &'a dyn Fn(&TrialRecord) -> Option<f64>;
    let rows: [(&str, Of<'_>); 5] = [
        ("angle less the wanted one, deg", &angle),
        ("speed less the wanted one, mm/s", &speed),
        ("force, N", &force),
        ("time in contact, s", &contact),
        ("time to the answer, s", &answered),
    ];
    for (name, of) in rows {
        if let Some([mean, sd, largest]) = spread(of) {
            // No negative zeros.
            let mean = (1e3 * mean).round() / 1e3 + 0.0;
            writeln!(out, "| {name} | {mean:.3} | {sd:.3} | {largest:.3} |")?;
        }
    }
    Ok(())
}

/// The table of valid answers, or the reason there is none.
fn table(p: &Protocol, records: &[TrialRecord]) -> Result<Result<Table, String>, StudyError> {
    let mut bytes = Vec::new();
    let mut valid: Vec<TrialRecord> = records.iter().filter(|r| r.is_valid()).cloned().collect();
    // Levels that are no numbers are then in the order of the protocol.
    valid.sort_by_key(|r| (r.subject, r.trial.block, r.trial.condition));
    write_trials(p, &valid, &mut bytes)?;
    // A factor with one level is not analysed.
    let varied = p.factors.iter().filter(|f| f.levels.len() > 1);
    let columns =
        Columns::new("subject", varied.map(|f| f.name.clone()), "answer").with_round("block");
    let columns = columns.complete_cases();
    let table = Table::read_csv(bytes.as_slice(), &columns);
    Ok(table.map_err(|error| error.to_string()))
}
