//! The report of a study.

use super::groups::{LevelGroups, level_groups};
use super::thresholds;
use crate::error::StudyError;
use crate::export::write_trials;
use crate::protocol::{Procedure, Protocol, TrialKind, TrialOrder};
use crate::run::TrialRecord;
use hwall::psychophysics::{
    Adjustment, Analysis, AnalysisConfig, Columns, ErrorModel, Normalisation, Study as Table,
    analyse,
};
use std::fmt::Write;

/// Pairs with an adjusted p below this differ.
const ALPHA: f64 = 0.05;

/// A study, analysed.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyReport {
    /// The analysis of the answers; none where they make no complete study.
    pub analysis: Option<Analysis>,
    /// Why there is none.
    pub why_not: Option<String>,
    /// Levels of each factor in groups.
    pub groups: Vec<LevelGroups>,
    /// The table that was analysed.
    pub table: Option<Table>,
    text: String,
}

impl StudyReport {
    /// Analyses the answers so far: magnitudes normalised by geometric means, both error models, pairs by Holm.
    ///
    /// # Errors
    /// A table that cannot be made. Answers that cannot be analysed yet are no error: the report says why.
    pub fn of(protocol: &Protocol, records: &[TrialRecord]) -> Result<Self, StudyError> {
        let table = match protocol.procedure.is_two_intervals() {
            true => Err("which of two was rougher gives thresholds".to_owned()),
            false => table(protocol, records)?,
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
        let analysed = table.and_then(|table| {
            let analysis = analyse(&table, &config).map_err(|error| error.to_string())?;
            Ok((table, analysis))
        });
        let mut report = Self {
            analysis: None,
            why_not: None,
            groups: Vec::new(),
            table: None,
            text: String::new(),
        };
        match analysed {
            Ok((table, analysis)) => {
                report.groups = level_groups(&analysis.posthoc, Adjustment::Holm, ALPHA);
                report.analysis = Some(analysis);
                report.table = Some(table);
            }
            Err(why_not) => report.why_not = Some(why_not),
        }
        report.text = report.write(protocol, records).unwrap_or_default();
        if protocol.procedure.is_two_intervals() {
            report.text += "\n## Thresholds\n\n";
            report.text += &thresholds::section(protocol, records)?;
        }
        Ok(report)
    }

    /// The report in Markdown; figures are linked by these names and captions.
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

    fn write(&self, p: &Protocol, records: &[TrialRecord]) -> Result<String, std::fmt::Error> {
        let mut out = String::new();
        writeln!(out, "# Study: {}\n", p.title)?;
        let done: Vec<&TrialRecord> = records.iter().collect();
        let main: Vec<&&TrialRecord> = done
            .iter()
            .filter(|r| r.trial.kind == TrialKind::Main)
            .collect();
        let valid: Vec<&TrialRecord> = main.iter().filter(|r| r.is_valid()).map(|r| **r).collect();
        let wanted = p.subjects * p.conditions() * p.repeats;
        methods(&mut out, p)?;
        writeln!(out, "\n## Trials\n")?;
        writeln!(
            out,
            "{} of {wanted} trials have a valid answer; {} attempts, {} of them spoilt.",
            valid.len(),
            done.len(),
            done.iter().filter(|r| !r.is_valid()).count()
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
        if p.procedure == Procedure::Magnitude {
            catch_trials(&mut out, &done)?;
        }
        writeln!(out, "\n## Result\n")?;
        if let Some(why_not) = &self.why_not {
            writeln!(out, "No analysis of variance: {why_not}.")?;
        }
        if let Some(analysis) = &self.analysis {
            for effect in &analysis.effects {
                let errors = match effect.errors {
                    ErrorModel::Pooled => "pooled error",
                    _ => "own errors",
                };
                let f = effect
                    .f
                    .finite()
                    .map_or("none".to_owned(), |f| format!("{f:.2}"));
                let p = effect.p.map_or("none".to_owned(), |p| format!("{p:.2e}"));
                let eta = effect.partial_eta2;
                let eta = eta.map_or("none".to_owned(), |e| format!("{e:.3}"));
                writeln!(
                    out,
                    "- {} ({errors}): F({}, {}) = {f}, p = {p}, partial eta squared {eta}",
                    effect.name, effect.df1, effect.df2
                )?;
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

/// The paragraph of the methods, in numbers.
fn methods(out: &mut String, p: &Protocol) -> std::fmt::Result {
    writeln!(out, "## Methods\n")?;
    let factors: Vec<String> = p
        .factors
        .iter()
        .map(|f| format!("{} ({})", f.name, f.levels.join(", ")))
        .collect();
    let order = match p.order {
        TrialOrder::Random => "in a random order of their own, no condition twice in a row",
        TrialOrder::Latin => "in the order of a balanced Latin square",
    };
    let asked = match p.procedure {
        Procedure::Magnitude => "gave a number in proportion to what they felt".to_owned(),
        Procedure::Likert { points } => format!("answered on a scale of {points} points"),
        Procedure::TwoIntervals | Procedure::Staircase | Procedure::Quest => {
            "said which of two touches was rougher, one of them always the first condition"
                .to_owned()
        }
    };
    let order = match p.procedure {
        Procedure::Staircase => "placed by a staircase, two down and one up",
        Procedure::Quest => "placed by QUEST+",
        _ => order,
    };
    writeln!(
        out,
        "{} subjects met {} conditions, {}, {} each, {order}. After each touch they {asked}. {} practice trials came first; \
         {} trials of each block were repeated right away to see how well answers agree; {}. A trial that was spoilt came again at the end of \
         its block, at most {} times in all. Seed {}.",
        p.subjects,
        p.conditions(),
        factors.join(" by "),
        match p.repeats {
            1 => "once".to_owned(),
            n => format!("{n} times"),
        },
        p.practice,
        p.catch_per_block,
        match p.break_after {
            0 => "there was no break".to_owned(),
            n => format!("a break came after {n} trials"),
        },
        p.most_attempts,
        p.seed
    )
}

/// Wanted beside rendered.
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
        "\n| rendered | mean | sd | largest |\n| --- | --- | --- | --- |"
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
            writeln!(out, "| {name} | {mean:.3} | {sd:.3} | {largest:.3} |")?;
        }
    }
    Ok(())
}

/// How well two answers to one condition agree.
fn catch_trials(out: &mut String, done: &[&TrialRecord]) -> std::fmt::Result {
    let mut ratios = Vec::new();
    for pair in done.windows(2) {
        let again = pair[1].trial.kind == TrialKind::Catch && pair[0].subject == pair[1].subject;
        if let (true, Some(a), Some(b)) = (again, pair[0].answer, pair[1].answer) {
            ratios.push((b / a).ln().abs());
        }
    }
    if ratios.is_empty() {
        return Ok(());
    }
    ratios.sort_by(f64::total_cmp);
    let median = ratios.get(ratios.len() / 2).copied().unwrap_or_default();
    writeln!(
        out,
        "\nOf {} conditions that were asked twice in a row, the median of the larger answer by the smaller is {:.3}.",
        ratios.len(),
        median.exp()
    )
}

/// The table of valid answers, or why there is none.
fn table(p: &Protocol, records: &[TrialRecord]) -> Result<Result<Table, String>, StudyError> {
    let mut bytes = Vec::new();
    let valid: Vec<TrialRecord> = records.iter().filter(|r| r.is_valid()).cloned().collect();
    write_trials(p, &valid, &mut bytes)?;
    // A factor of one level is no factor of the analysis.
    let varied = p.factors.iter().filter(|f| f.levels.len() > 1);
    let columns =
        Columns::new("subject", varied.map(|f| f.name.clone()), "answer").with_round("block");
    let table = Table::read_csv(bytes.as_slice(), &columns);
    Ok(table.map_err(|error| error.to_string()))
}
