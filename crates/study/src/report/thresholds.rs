//! Thresholds of studies with two intervals.

use crate::error::StudyError;
use crate::protocol::{Procedure, Protocol, TrialKind};
use crate::run::{Adaptive, AdaptiveThreshold, TrialRecord};
use hwall::psychophysics::{PairAnswers, Sigmoid, threshold};
use std::fmt::Write;

/// Confidence of all intervals.
const CONFIDENCE: f64 = 0.95;

/// The section of thresholds, in Markdown.
///
/// # Errors
/// Levels that an adaptive procedure cannot use.
pub(super) fn section(p: &Protocol, records: &[TrialRecord]) -> Result<String, StudyError> {
    let mut out = String::new();
    let Ok(levels) = p.rising_levels() else {
        return Ok(
            "No threshold: it takes one factor whose levels are numbers that rise.\n".to_owned(),
        );
    };
    let counts = || records.iter().filter(|r| r.trial.kind == TrialKind::Main);
    let answers: Vec<PairAnswers> = levels
        .iter()
        .enumerate()
        .filter_map(|(condition, stimulus)| {
            let own = counts().filter(|r| r.trial.condition == condition);
            let judged: Vec<bool> = own.filter_map(TrialRecord::judged_rougher).collect();
            let greater = judged.iter().filter(|rougher| **rougher).count() as u32;
            (!judged.is_empty()).then_some(PairAnswers {
                stimulus: *stimulus,
                greater,
                trials: judged.len() as u32,
            })
        })
        .collect();
    let name = p.factors.first().map_or("stimulus", |f| f.name.as_str());
    let _ = writeln!(
        out,
        "| {name} | judged rougher than {} | of |\n| --- | --- | --- |",
        levels[0]
    );
    for a in &answers {
        let _ = writeln!(out, "| {} | {} | {} |", a.stimulus, a.greater, a.trials);
    }
    match threshold(&answers, Sigmoid::CumulativeGaussian, levels[0], CONFIDENCE) {
        Ok(t) => {
            let _ = writeln!(
                out,
                "\nAll answers together as those of one observer, cumulative Gaussian, with 95 % intervals for the chance of single \
                 answers, not for that of who took part: point of subjective equality {:.3} ({:.3} to {:.3}), just noticeable \
                 difference {:.3} ({:.3} to {:.3}), Weber fraction {:.3} ({:.3} to {:.3}).",
                t.function.pse,
                t.pse_ci[0],
                t.pse_ci[1],
                t.function.jnd,
                t.jnd_ci[0],
                t.jnd_ci[1],
                t.weber,
                t.weber_ci[0],
                t.weber_ci[1]
            );
            let last = levels.last().copied().unwrap_or_default();
            if !(levels[0]..=last).contains(&t.function.pse) || t.function.jnd > last - levels[0] {
                let _ = writeln!(
                    out,
                    "\nThey lie outside of the levels that were presented: these answers hardly place them."
                );
            }
        }
        Err(error) => {
            let _ = writeln!(out, "\nNo function fits all subjects together: {error}.");
        }
    }
    let Some(rule) = Adaptive::of(p)? else {
        return Ok(out);
    };
    let what = match p.procedure {
        Procedure::Staircase => "places among the levels at which 70.7 % are right",
        _ => "levels halfway between guessing and certainty",
    };
    let _ = writeln!(
        out,
        "\nThresholds of the subjects ({what}), with 95 % intervals:\n"
    );
    for subject in 0..p.subjects {
        let own = records.iter().filter(|r| r.subject == subject);
        if own.clone().next().is_none() {
            continue;
        }
        let found = match rule.clone().after(own)?.threshold()? {
            AdaptiveThreshold::Staircase(Some(t)) => Some((t.threshold, t.ci)),
            AdaptiveThreshold::Staircase(None) => None,
            AdaptiveThreshold::Quest(t) => Some((t.threshold, t.threshold_ci)),
        };
        let text = found.map_or("too few reversals".to_owned(), |(t, [low, high])| {
            format!("{t:.3} ({low:.3} to {high:.3})")
        });
        let _ = writeln!(out, "- {}: {text}", p.pseudonym(subject));
    }
    Ok(out)
}
