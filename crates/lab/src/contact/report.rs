//! The study of one set of reaches: all candidates, their tables, rows and figures.

use crate::contact::candidates::Candidate;
use crate::contact::figures;
use crate::contact::recordings::{Recorded, Source, read};
use crate::contact::run::{EstimateRows, Scores, run};
use crate::contact::tables;
use anyhow::Context;
use hwall_contact::score::Split;
use hwall_hand::{HandFrame, LabelledReach, NamedPoint};
use hwall_stage::numbers::counted;
use hwall_testkit::quantiles;
use std::path::Path;

/// Fewer reaches are an illustration, not a result.
const FEW: usize = 10;
/// The learned estimator uses quantities seen in at least this share of the samples.
const USUALLY_SEEN: f64 = 0.8;

/// A part of the study.
#[derive(Debug, Clone, Default)]
pub struct Section {
    /// Markdown.
    pub text: String,
    /// The sets of reaches in it by name, with the scores of all candidates.
    pub sets: Vec<(String, Vec<Scores>)>,
}

/// The scores of all candidates on one set of reaches.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// In the order of the candidates.
    pub scores: Vec<Scores>,
    /// Candidates that could not be trained, and why.
    pub not_run: Vec<String>,
}

impl Comparison {
    /// Runs an additional candidate on the set.
    pub fn add(&mut self, candidate: &Candidate, reaches: &[LabelledReach], split: &Split) {
        self.take(candidate, run(candidate, reaches, split, None));
    }

    fn take(&mut self, candidate: &Candidate, found: anyhow::Result<Scores>) {
        match found {
            Ok(scores) => self.scores.push(scores),
            Err(error) => self.not_run.push(format!("{}: {error:#}", candidate.name)),
        }
    }

    /// Missing data and the tables; `more` is inserted after the first table.
    pub fn text(&self, absent: &[String], more: &str) -> String {
        let mut text = String::new();
        for note in absent {
            text += &format!("\nNot there: {note}.\n");
        }
        for note in &self.not_run {
            text += &format!("\nNot run: {note}.\n");
        }
        if !self.scores.is_empty() {
            let (short, long) = (
                tables::in_short(&self.scores),
                tables::markdown(&self.scores),
            );
            text += &format!("{short}\n{more}{long}");
        }
        text
    }
}

/// Runs every candidate on one set of reaches.
///
/// With a folder, it gets: `NAME_predictions.csv` (one row per prediction at the moments of the tables, and one every
/// 50 ms), `NAME_scores.csv`, `NAME_error.svg` and
/// `NAME_reliability.svg`.
///
/// # Errors
/// A file that cannot be written.
pub fn compare(
    name: &str,
    candidates: &[Candidate],
    reaches: &[LabelledReach],
    split: &Split,
    out: Option<&Path>,
) -> anyhow::Result<Comparison> {
    let file = |what: &str| out.map(|folder| folder.join(format!("{name}_{what}")));
    let rows = file("predictions.csv").map(|path| EstimateRows::create(&path, name));
    let mut rows = rows.transpose()?;
    let mut comparison = Comparison {
        scores: Vec::new(),
        not_run: Vec::new(),
    };
    for candidate in candidates {
        eprintln!("{name}: training and judging {}", candidate.name);
        let found = run(candidate, reaches, split, rows.as_mut());
        comparison.take(candidate, found);
    }
    if let Some(rows) = rows {
        rows.finish()?;
    }
    let scores = &comparison.scores;
    if let Some(path) = file("scores.csv") {
        tables::csv(&path, name, scores)?;
    }
    let judged: usize = split.folds.iter().map(|f| f.test.len()).sum();
    if let (Some(path), false) = (file("error.svg"), scores.is_empty()) {
        let title = format!("{name}: where {judged} reaches end, none of them learnt from");
        figures::error_over_time(&path, &title, scores)?;
    }
    if let Some(path) = file("reliability.svg") {
        let title = format!("{name}: calibration, 30 to 90 % of {judged} reaches");
        figures::reliability(&path, &title, scores)?;
    }
    Ok(comparison)
}

/// The data of the reaches available to the estimators.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Points of the hand; `None` for all.
    pub points: Option<Vec<NamedPoint>>,
    /// May the learned estimator use the gaze?
    pub gaze: bool,
}

impl Choice {
    /// Requested but missing data: a line for each point, and for the gaze, that is seen too seldom for the
    /// learned estimator.
    pub fn absent(&self, reaches: &[LabelledReach]) -> Vec<String> {
        let frames = || reaches.iter().flat_map(|r| &r.frames);
        let share = |seen: &dyn Fn(&HandFrame) -> bool| {
            let count = frames().filter(|f| seen(f)).count();
            count as f64 / frames().count().max(1) as f64
        };
        let points = self.points.iter().flatten().map(|point| {
            let share = share(&|f| f.named(*point).is_some());
            ("--points", point.name(), share)
        });
        let gaze = self.gaze.then(|| {
            let share = share(&|f| f.gaze_ray().is_some());
            ("--gaze", "the gaze", share)
        });
        let asked = points.chain(gaze).filter(|asked| asked.2 < USUALLY_SEEN);
        let line = |(flag, what, share)| {
            format!(
                "{flag}: {what} is seen in {:.0} % of the samples; it is left out, for which {:.0} % would be needed",
                100.0 * share,
                100.0 * USUALLY_SEEN
            )
        };
        asked.map(line).collect()
    }

    /// Removes unavailable data; the touching point always stays.
    pub fn apply(&self, reaches: &mut [LabelledReach]) {
        let Some(points) = &self.points else { return };
        for reach in reaches {
            let mut seen = points.clone();
            seen.push(NamedPoint::Hand(reach.point));
            for frame in &mut reach.frames {
                *frame = frame.limited_to(&seen, true);
            }
        }
    }
}

/// The study of a recording, or of every recording under a folder, as Markdown.
///
/// # Errors
/// No recordings found, or a file that cannot be written.
pub fn recordings<'a>(
    recorded: impl Into<Recorded<'a>>,
    candidates: &[Candidate],
    choice: &Choice,
    out: Option<&Path>,
) -> anyhow::Result<Section> {
    let found = read(recorded)?;
    let mut sets = Vec::new();
    let mut text = String::from("## Recorded hands\n");
    for why in found.refused {
        text += &format!("\nNot read: {why}.\n");
    }
    for mut source in found.sources {
        choice.apply(&mut source.reaches);
        text += &format!("\n{}", heading(&source));
        if source.reaches.len() < 2 {
            text += "\nNothing to learn from: at least 2 reaches are needed, one to learn from and one to be judged.\n";
            continue;
        }
        let split = source.split();
        let compared = compare(&source.name, candidates, &source.reaches, &split, out)
            .with_context(|| source.name.clone())?;
        let own = compared.text(&choice.absent(&source.reaches), "");
        text += &format!(" Split: {}.\n{own}", split.description);
        if !compared.scores.is_empty() {
            sets.push((source.name, compared.scores));
        }
    }
    Ok(Section { text, sets })
}

fn heading(source: &Source) -> String {
    let reaches = &source.reaches;
    let n = reaches.len();
    let mut text = format!("### {}: {}", source.name, counted(n, "reach", "reaches"));
    if n > 0 {
        let start_m = |r: &LabelledReach| r.frames.iter().find_map(|f| f.point(r.point));
        let lengths_m = reaches
            .iter()
            .filter_map(|r| Some(start_m(r)?.distance(r.contact_m)));
        let [length_m] = quantiles(lengths_m, [0.5]);
        let [duration_s] = quantiles(reaches.iter().map(LabelledReach::duration_s), [0.5]);
        text += &format!(" of {length_m:.2} m and {duration_s:.2} s (medians)");
    }
    text += &format!("\n\n{}.", source.description);
    if n < FEW {
        text +=
            &format!(" Too few for conclusions, for which {FEW} would be needed: an illustration.");
    }
    for (what, list, between) in [
        ("Left out", &source.left_out, "; "),
        ("Ignored columns", &source.ignored_columns, ", "),
    ] {
        if !list.is_empty() {
            text += &format!(" {what}: {}.", list.join(between));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use hwall_hand::{HandFrame, HandPoint};

    #[test]
    fn what_was_asked_for_and_is_not_there_is_said() {
        let frame = |k: u32| {
            let mut frame = HandFrame::empty(0.01 * f64::from(k));
            frame.set_point(HandPoint::Index, Some(DVec3::X));
            let seldom = k.is_multiple_of(2).then_some(DVec3::Y);
            frame.set_point(HandPoint::Thumb, seldom);
            frame
        };
        let frames = (0..10).map(frame).collect();
        let reaches = [LabelledReach::new(HandPoint::Index, frames, DVec3::X, 0.09)];
        let points = [HandPoint::Index, HandPoint::Thumb, HandPoint::Ring].map(NamedPoint::Hand);
        let choice = Choice {
            points: Some(points.to_vec()),
            gaze: true,
        };
        let notes = choice.absent(&reaches);
        assert_eq!(notes.len(), 3, "{notes:?}");
        assert!(notes[0].contains("thumb is seen in 50 %"), "{notes:?}");
        assert!(notes[1].contains("ring is seen in 0 %"), "{notes:?}");
        assert!(notes[2].starts_with("--gaze"), "{notes:?}");
        assert_eq!(Choice::default().absent(&reaches), Vec::<String>::new());
    }
}
