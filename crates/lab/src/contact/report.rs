//! The study of one set of reaches: all candidates, their tables, rows and figures.

use crate::contact::candidates::Candidate;
use crate::contact::figures;
use crate::contact::recordings::{FoundSources, Recorded, Source, read};
use crate::contact::rows::EstimateRows;
use crate::contact::run::run;
use crate::contact::scores::Scores;
use crate::contact::tables;
use crate::report::quantiles;
use anyhow::Context;
use hwall_contact::score::Split;
use hwall_hand::{LabelledReach, NamedPoint};
use hwall_stage::numbers::counted;
use std::fmt::Write as _;
use std::path::Path;

/// Fewer reaches than this are an illustration, not a result.
const FEW: usize = 10;
/// The learned estimator looks at what is seen in this share of the samples.
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

/// Runs every candidate on one set of reaches.
///
/// With a folder: `NAME_predictions.csv` (one row a prediction at the moments of the tables, and one every
/// 50 ms), `NAME_scores.csv`, `NAME_error.svg` and
/// `NAME_reliability.svg` in it.
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
    let mut rows = match file("predictions.csv") {
        Some(path) => Some(EstimateRows::create(&path, name)?),
        None => None,
    };
    let (mut scores, mut not_run) = (Vec::new(), Vec::new());
    for candidate in candidates {
        match run(candidate, reaches, split, rows.as_mut()) {
            Ok(found) => scores.push(found),
            Err(error) => not_run.push(format!("{}: {error:#}", candidate.name)),
        }
    }
    if let Some(rows) = rows {
        rows.finish()?;
    }
    if let Some(path) = file("scores.csv") {
        tables::csv(&path, name, &scores)?;
    }
    let judged: usize = split.folds.iter().map(|f| f.test.len()).sum();
    if let (Some(path), false) = (file("error.svg"), scores.is_empty()) {
        let title = format!("{name}: where {judged} reaches end, none of them learnt from");
        figures::error_over_time(&path, &title, &scores)?;
    }
    if let Some(path) = file("reliability.svg") {
        let title = format!("{name}: calibration, 30 to 90 % of {judged} reaches");
        figures::reliability(&path, &title, &scores)?;
    }
    Ok(Comparison { scores, not_run })
}

/// What the estimators may see of the reaches.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Points of the hand; `None` for all.
    pub points: Option<Vec<NamedPoint>>,
    /// Is the learned estimator to see the gaze?
    pub gaze: bool,
}

impl Choice {
    /// What was asked for and is not there: a line for each point and for the gaze that is seen too seldom for the
    /// learned estimator to look at.
    pub fn absent(&self, reaches: &[LabelledReach]) -> Vec<String> {
        let frames = || reaches.iter().flat_map(|r| &r.frames);
        let count = frames().count();
        let seldom = |seen: usize| (seen as f64) < USUALLY_SEEN * count as f64 || count == 0;
        let line = |flag: &str, what: &str, seen: usize| {
            format!(
                "{flag}: {what} is seen in {:.0} % of the samples; it is left out, for which {:.0} % would be needed",
                100.0 * seen as f64 / count.max(1) as f64,
                100.0 * USUALLY_SEEN
            )
        };
        let points = self.points.iter().flatten().map(|point| {
            let seen = frames().filter(|f| f.named(*point).is_some()).count();
            ("--points", point.name(), seen)
        });
        let seen = frames().filter(|f| f.gaze_ray().is_some()).count();
        let gaze = self.gaze.then_some(("--gaze", "the gaze", seen));
        let asked = points.chain(gaze);
        asked
            .filter(|(_, _, seen)| seldom(*seen))
            .map(|(flag, what, seen)| line(flag, what, seen))
            .collect()
    }

    /// Takes away what may not be seen; the touching point always stays.
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
/// No recordings there, or a file that cannot be written.
pub fn recordings<'a>(
    recorded: impl Into<Recorded<'a>>,
    candidates: &[Candidate],
    choice: &Choice,
    out: Option<&Path>,
) -> anyhow::Result<Section> {
    let FoundSources {
        mut sources,
        refused,
    } = read(recorded)?;
    sources
        .iter_mut()
        .for_each(|s| choice.apply(&mut s.reaches));
    let mut sets = Vec::new();
    let mut text = String::from("## Recorded hands\n");
    for why in refused {
        write!(text, "\nNot read: {why}.\n")?;
    }
    for source in &sources {
        write!(text, "\n{}", heading(source))?;
        if source.reaches.len() < 2 {
            writeln!(
                text,
                "\nNothing to learn from: at least 2 reaches are needed, one to learn from and one to be judged."
            )?;
            continue;
        }
        for note in choice.absent(&source.reaches) {
            writeln!(text, "\nNot there: {note}.\n")?;
        }
        let split = source.split();
        let Comparison { scores, not_run } =
            compare(&source.name, candidates, &source.reaches, &split, out)
                .with_context(|| source.name.clone())?;
        writeln!(text, " Split: {}.", split.description)?;
        for note in not_run {
            writeln!(text, "\nNot run: {note}.")?;
        }
        if !scores.is_empty() {
            write!(
                text,
                "{}\n{}",
                tables::in_short(&scores),
                tables::markdown(&scores)
            )?;
            sets.push((source.name.clone(), scores));
        }
    }
    Ok(Section { text, sets })
}

fn heading(source: &Source) -> String {
    let reaches = &source.reaches;
    let median = |values: Vec<f64>| quantiles(values, [0.5])[0];
    let n = reaches.len();
    let mut text = format!("### {}: {}", source.name, counted(n, "reach", "reaches"));
    if n > 0 {
        let start_m = |r: &LabelledReach| r.frames.iter().find_map(|f| f.point(r.point));
        let lengths = reaches
            .iter()
            .filter_map(|r| Some(start_m(r)?.distance(r.contact_m)));
        let _ = write!(
            text,
            " of {:.2} m and {:.2} s (medians)",
            median(lengths.collect()),
            median(reaches.iter().map(LabelledReach::duration_s).collect())
        );
    }
    let _ = write!(text, "\n\n{}.", source.description);
    if n < FEW {
        let _ = write!(
            text,
            " Too few for conclusions, for which {FEW} would be needed: an illustration."
        );
    }
    if !source.left_out.is_empty() {
        let _ = write!(text, " Left out: {}.", source.left_out.join("; "));
    }
    if !source.ignored_columns.is_empty() {
        let _ = write!(
            text,
            " Ignored columns: {}.",
            source.ignored_columns.join(", ")
        );
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
