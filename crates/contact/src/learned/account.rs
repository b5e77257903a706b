//! Summary of a trained model.

use super::blend::combination::{Axes, Blend, Region, combine};
use super::blend::evidence::Evidence;
use super::blend::sources::{SOURCES, Source};
use super::quantiles::weighted_quantile;
use super::reaches::reach_track::{BlockKind, Cue, Inputs};
use super::regression::local_ridge::Fitted;
use std::fmt;

/// Stages of the time left for which errors are reported, s; the last has no end.
const STAGES_S: [f64; 6] = [0.0, 0.05, 0.1, 0.2, 0.4, 0.8];

/// The choices of training and their errors on held-out reaches; [`LearnedModel`](super::LearnedModel) prints it as a table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Account {
    /// Number of regions of progress.
    pub regions: usize,
    /// The inputs of the regression, and the share of the regions that use each: with the place in the room, and without.
    pub inputs: Vec<InputUse>,
    /// True if error statistics use axes along and across the path of the hand; false if they use the axes of the room.
    pub along_the_way: bool,
    /// Scatter of touches of one place, sd, m.
    pub place_scatter_m: f64,
    /// One entry per range of the time left.
    pub stages: Vec<StageAccount>,
}

/// How much an input is used.
#[derive(Debug, Clone, PartialEq)]
pub struct InputUse {
    /// For tables.
    pub name: String,
    /// Share of the regions that use it, with the place in the room and without.
    pub used: [f64; 2],
}

/// Held-out errors in one range of the time left.
#[derive(Debug, Clone, PartialEq)]
pub struct StageAccount {
    /// Start of this range of time left, s; it ends at that of the next one.
    pub from_s: f64,
    /// Median error of the combination before places are considered, m; NaN without samples.
    pub median_m: f64,
    /// Mean weight of every source, with its name.
    pub weights: Vec<(&'static str, f64)>,
    /// Mean share of the distance to the places that is applied.
    pub places: f64,
}

/// The model relies on a point if the regression uses it in more than this share of the regions.
const RELIED_ON: f64 = 0.25;

impl Account {
    pub(super) fn relies_on(&self, cue: Cue) -> bool {
        let names = match cue {
            Cue::Point(p) => [BlockKind::Place(p), BlockKind::Motion(p)].map(name),
            Cue::Head => [BlockKind::HeadPlace, BlockKind::HeadMotion].map(name),
            Cue::Gaze => [BlockKind::Gaze; 2].map(name),
        };
        let relied = |input: &InputUse| input.used.iter().any(|share| *share > RELIED_ON);
        let mut inputs = self.inputs.iter().filter(|i| names.contains(&i.name));
        inputs.any(relied)
    }

    pub(super) fn of(
        evidence: &Evidence,
        blend: &Blend,
        inputs: &Inputs,
        fitted: &[Fitted; 2],
        made: usize,
    ) -> Self {
        let share = |k: usize, block: usize| {
            let used = fitted[k].used.iter().filter(|used| used[block]).count();
            used as f64 / fitted[k].used.len().max(1) as f64
        };
        let inputs = inputs.blocks().into_iter().enumerate();
        let inputs = inputs.map(|(block, b)| InputUse {
            name: name(b.kind),
            used: [share(0, block), share(1, block)],
        });
        Self {
            regions: blend.regions.len(),
            inputs: inputs.collect(),
            along_the_way: blend.axes == Axes::Way,
            place_scatter_m: evidence.places.map_or(0.0, |p| p.scatter_m),
            stages: (0..STAGES_S.len())
                .map(|k| stage(evidence, blend, k, made))
                .collect(),
        }
    }
}

/// Errors of the first `made` reaches: time-scaled copies do not count as evidence.
fn stage(evidence: &Evidence, blend: &Blend, stage: usize, made: usize) -> StageAccount {
    let until_s = STAGES_S.get(stage + 1).copied().unwrap_or(f64::INFINITY);
    let (mut errors, mut sums) = (Vec::new(), [0.0; SOURCES]);
    let (mut places, mut total) = (0.0, f64::MIN_POSITIVE);
    for (row, sample) in evidence.samples.iter().enumerate() {
        if sample.reach >= made || !(STAGES_S[stage]..until_s).contains(&sample.left_s) {
            continue;
        }
        let region = Region::between(&blend.regions, evidence.rows.gates(row));
        let ends_m = &evidence.witnesses[row].ends_m;
        let Some(combined) = combine(&region, ends_m, &[1.0; SOURCES]) else {
            continue;
        };
        errors.push((combined.point_m.distance(sample.end_m), sample.weight));
        for (sum, weight) in sums.iter_mut().zip(combined.weights) {
            *sum += weight * sample.weight;
        }
        places += region.share * sample.weight;
        total += sample.weight;
    }
    let median_m = match errors.is_empty() {
        true => f64::NAN,
        false => weighted_quantile(0.5, errors.into_iter()),
    };
    StageAccount {
        from_s: STAGES_S[stage],
        median_m,
        weights: Source::ALL
            .map(|s| (s.name(), sums[s as usize] / total))
            .to_vec(),
        places: places / total,
    }
}

fn name(kind: BlockKind) -> String {
    match kind {
        BlockKind::Path => "path of the touching point".to_owned(),
        BlockKind::Start => "place in the room".to_owned(),
        BlockKind::HeadPlace => "place of the head at the start".to_owned(),
        BlockKind::HeadMotion => "motion of the head".to_owned(),
        BlockKind::Gaze => "gaze".to_owned(),
        BlockKind::Place(p) => format!("place of {}", p.name()),
        BlockKind::Motion(p) => format!("motion of {}", p.name()),
    }
}

impl fmt::Display for Account {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axes = if self.along_the_way {
            "the way"
        } else {
            "the room"
        };
        writeln!(
            f,
            "{} regions of progress; errors alike along {axes}; touches of one place scatter by {:.0} mm\n",
            self.regions,
            1e3 * self.place_scatter_m
        )?;
        writeln!(
            f,
            "| input | used in % of the regions | without the room |\n| --- | --- | --- |"
        )?;
        for input in &self.inputs {
            let [room, start] = input.used.map(|u| 100.0 * u);
            writeln!(f, "| {} | {room:.0} | {start:.0} |", input.name)?;
        }
        write!(f, "\n| time left, ms | held-out median, mm |")?;
        let names: Vec<&str> = self
            .stages
            .first()
            .map_or(Vec::new(), |s| s.weights.iter().map(|w| w.0).collect());
        for name in &names {
            write!(f, " {name}, % |")?;
        }
        writeln!(
            f,
            " towards places, % |\n| --- | --- |{} --- |",
            " --- |".repeat(names.len())
        )?;
        for s in self.stages.iter().filter(|s| s.median_m.is_finite()) {
            write!(
                f,
                "| from {:.0} | {:.1} |",
                1e3 * s.from_s,
                1e3 * s.median_m
            )?;
            for (_, weight) in &s.weights {
                write!(f, " {:.0} |", 100.0 * weight)?;
            }
            writeln!(f, " {:.0} |", 100.0 * s.places)?;
        }
        Ok(())
    }
}
