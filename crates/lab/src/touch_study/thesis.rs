//! The dissertation's studies redone, next to the published results.
//!
//! [`redone`] runs a protocol with simulated participants. From any record of such a study, including one with people, [`rows`] makes rows
//! with the published and the new numbers, and [`figures`](super::outputs::figures) draws the figures.

pub use crate::dissertation::Row;
use crate::dissertation::{LEVELS, NOT_HERE, ORDERS, POINTS, SUBJECTS, TABLE_V};
use crate::report::ends;
use anyhow::{Context, bail, ensure};
use hwall_psychophysics::{
    Analysis, Effect, ErrorModel, for_each_outcome, median, sign_test, wilcoxon_signed_rank_exact,
};
use hwall_study::{
    Durability, EXPERIMENT_2_MEANS, LevelGroups, Participants, Procedure, RatingPower,
    ReadyProtocol, SimulatedStage, Simulation, Study, StudyRecord, StudyReport, mean_power,
    planted_for, ratings, sign_power, simulate,
};
use hwall_testkit::{MarkdownTable, cells, or_none, titled};

/// Shares of people who prefer one wall, for which the power is computed.
const SHARES: [f64; 4] = [0.6, 0.75, 0.9, 0.95];

/// Runs a ready protocol with simulated participants; each condition is presented once on the simulated arm.
///
/// # Errors
/// A number of subjects that a study cannot have; a folder for temporary files that cannot be written.
pub fn redone(ready: ReadyProtocol, subjects: usize, seed: u64) -> anyhow::Result<StudyRecord> {
    static NUMBER: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);
    let number = NUMBER.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    let name = format!("hwall_thesis_{}_{number}", std::process::id());
    let folder = std::env::temp_dir().join(name);
    let _ = std::fs::remove_dir_all(&folder);
    let mut protocol = ready.protocol();
    (protocol.subjects, protocol.seed) = (subjects, seed);
    let simulation = Simulation {
        participants: planted_for(&protocol),
        once_per_condition: true,
        kill_after: None,
    };
    let who = Participants::Simulated {
        once_per_condition: true,
    };
    let run = || -> anyhow::Result<StudyRecord> {
        let mut study = Study::create(&folder, protocol, who, Durability::System)?;
        simulate(&mut study, &SimulatedStage::new()?, &simulation)?;
        Ok(study.record())
    };
    let record = run();
    let _ = std::fs::remove_dir_all(&folder);
    record
}

/// Experiment 1: a whiteboard against H-Wall; high answers favour H-Wall.
fn first_rows(study: &StudyRecord) -> anyhow::Result<Vec<Row>> {
    let answers = ratings(study)?.into_iter().next();
    let a = answers.context("nobody has answered")?;
    let share = a.above.map_or("nobody decided".to_owned(), |s| {
        let [low, high] = s.ci;
        format!("{} of {} ({low:.3} to {high:.3})", s.successes, s.trials)
    });
    let mut rows = vec![
        Row::new("subjects", SUBJECTS.to_string(), a.subjects.to_string()),
        Row::new("H-Wall more real, of the decided", NOT_HERE, share),
        Row::new("sign test, p", NOT_HERE, format!("{:.4}", a.signs.p)),
    ];
    for agree in [SUBJECTS, SUBJECTS - 1] {
        let signs: Vec<f64> = (0..SUBJECTS)
            .map(|i| if i < agree { 1.0 } else { -1.0 })
            .collect();
        let what = format!("sign test, p if {agree} of {SUBJECTS} agree");
        let p = sign_test(&signs).map(|test| test.p).ok();
        rows.push(Row::new(what, "not given", or_none(p, 4)));
    }
    for power in sign_power(&SHARES, SUBJECTS)? {
        let population = format!("if a share of {} prefers one wall", power.population);
        rows.push(power_row(&power, &population));
    }
    Ok(rows)
}

fn power_row(power: &RatingPower, population: &str) -> Row {
    let needed = power
        .subjects
        .map_or("too many".to_owned(), |n| n.to_string());
    let ours = format!("{needed} (power of {SUBJECTS}: {:.3})", power.power);
    Row::new(
        format!("people for a power of 0.8 {population}"),
        "not given",
        ours,
    )
}

/// Test results of all possible sets of answers with a published mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Possible {
    /// Sets of answers with this mean.
    pub sets: usize,
    /// Least and greatest p of the exact signed-rank test against the middle of the scale.
    pub p: [f64; 2],
    /// Least and greatest median.
    pub median: [f64; 2],
}

/// All sets of answers of eight people, 1 to 5, with this mean.
///
/// # Errors
/// A mean that no such set has.
pub fn possible(mean: f64) -> anyhow::Result<Possible> {
    let (mut p, mut medians) = (Vec::new(), Vec::new());
    for_each_outcome(POINTS, SUBJECTS, |counts| {
        let points = (1..).zip(counts);
        let points = points.flat_map(|(point, n)| std::iter::repeat_n(f64::from(point), *n));
        let answers: Vec<f64> = points.collect();
        let off_by = answers.iter().sum::<f64>() - mean * SUBJECTS as f64;
        if off_by.abs() <= 1e-9 {
            let middle = 0.5 * (POINTS as f64 + 1.0);
            let off: Vec<f64> = answers.iter().map(|a| a - middle).collect();
            p.push(wilcoxon_signed_rank_exact(&off).map_or(1.0, |test| test.p));
            medians.extend(median(&answers, 0.95).map(|m| m.value));
        }
    })?;
    ensure!(
        !p.is_empty(),
        "eight answers from 1 to 5 never have the mean {mean}"
    );
    let range = |values: &[f64]| <[f64; 2]>::from(ends(values.iter().copied()));
    Ok(Possible {
        sets: p.len(),
        p: range(&p),
        median: range(&medians),
    })
}

/// Experiment 2: three questions about H-Wall.
fn question_rows(study: &StudyRecord) -> anyhow::Result<Vec<Row>> {
    let answers = ratings(study)?;
    let (asked, answered) = (EXPERIMENT_2_MEANS.len(), answers.len());
    ensure!(
        answered == asked,
        "{answered} of {asked} questions have an answer"
    );
    let power = mean_power(POINTS as u8, &EXPERIMENT_2_MEANS, SUBJECTS)?;
    let mut rows = Vec::new();
    for (number, (power, a)) in (1..).zip(power.iter().zip(&answers)) {
        let mean = power.population;
        let possible = possible(mean)?;
        let ([low, high], [least, most]) = (possible.median, possible.p);
        let ci = a.median.ci.map(|[a, b]| format!(" ({a} to {b})"));
        rows.extend([
            Row::new(
                format!("question {number}, mean"),
                mean.to_string(),
                format!("{:.3}", a.mean),
            ),
            Row::new(
                format!("question {number}, median"),
                format!("{low} to {high}, by its mean"),
                format!("{}{}", a.median.value, ci.unwrap_or_default()),
            ),
            Row::new(
                format!("question {number}, signed ranks against 3, p"),
                format!(
                    "{least:.4} to {most:.4}, by its mean ({} sets)",
                    possible.sets
                ),
                or_none(a.wilcoxon.map(|w| w.p), 4),
            ),
            power_row(power, &format!("at the mean {mean}")),
        ]);
    }
    Ok(rows)
}

/// Result of a study of magnitudes.
#[derive(Debug, Clone, PartialEq)]
pub struct Magnitudes {
    /// Analysis of the normalised estimates, with both error models; its cells are the curves of V-8 and V-13.
    pub analysis: Analysis,
    /// Levels of each factor in groups that do not differ.
    pub groups: Vec<LevelGroups>,
}

impl Magnitudes {
    /// The result of a record.
    ///
    /// # Errors
    /// Answers that cannot be analysed yet.
    pub fn of(study: &StudyRecord) -> anyhow::Result<Self> {
        let report = StudyReport::of(study)?;
        let Some(analysis) = report.analysis else {
            bail!(report.why_not.unwrap_or_default());
        };
        Ok(Self {
            groups: report.groups,
            analysis,
        })
    }

    /// Number of distinguishable levels of roughness: the product, over the factors, of the number of levels that differ from each other.
    /// This is our interpretation of the dissertation's nine.
    #[must_use]
    pub fn distinct(&self) -> usize {
        self.groups.iter().map(distinct).product()
    }

    /// The effects against one residual, as in table V.
    fn pooled(&self) -> Vec<&Effect> {
        let effects = self.analysis.effects.iter();
        effects.filter(|e| e.errors == ErrorModel::Pooled).collect()
    }

    /// The analysis of variance in the form of table V: one residual for all effects.
    #[must_use]
    pub fn table_v(&self) -> MarkdownTable {
        let mut table = titled(
            "source | sum of squares | degrees of freedom | mean square | F | p | partial eta squared",
        );
        let squares = |name: &str, ss: f64, df: usize| {
            let mean = ss / df as f64;
            cells(
                [name],
                [format!("{ss:.3}"), df.to_string(), format!("{mean:.3}")],
            )
        };
        let pooled = self.pooled();
        for e in &pooled {
            let f = or_none(e.f.finite(), 3);
            let tested = [f, probability(e.p), or_none(e.partial_eta2, 4)];
            table.row(squares(&e.name, e.ss, e.df1).into_iter().chain(tested));
        }
        if let Some(e) = pooled.last() {
            let empty = ["", "", ""].map(str::to_owned);
            table.row(squares("error", e.ss_error, e.df2).into_iter().chain(empty));
        }
        table
    }

    /// One row for each effect, with what was published about it, and one for the order of each factor's levels.
    fn rows(&self, effects: [&str; 3], orders: [&str; 2]) -> Vec<Row> {
        let of = |(e, published): (&Effect, &str)| {
            let f = or_none(e.f.finite(), 3);
            let eta2 = or_none(e.partial_eta2, 4);
            let ours = format!("{f}, p = {}, partial eta squared {eta2}", probability(e.p));
            Row::new(
                format!("{}, F({}, {})", e.name, e.df1, e.df2),
                published,
                ours,
            )
        };
        let mut rows: Vec<Row> = self.pooled().into_iter().zip(effects).map(of).collect();
        let of = |(g, published): (&LevelGroups, &str)| {
            Row::new(format!("order by {}", g.factor), published, g.to_text())
        };
        rows.extend(self.groups.iter().zip(orders).map(of));
        rows
    }
}

fn probability(p: Option<f64>) -> String {
    match p {
        Some(p) if p < 1e-4 => format!("{p:.1e}"),
        other => or_none(other, 4),
    }
}

/// Length of a chain of levels from the least mean on, each significantly above the one before.
fn distinct(groups: &LevelGroups) -> usize {
    let mut chain: Vec<&str> = Vec::new();
    for level in &groups.order {
        if chain.last().is_none_or(|last| groups.is_less(last, level)) {
            chain.push(level);
        }
    }
    chain.len()
}

/// Rows of a record of one of the dissertation's studies; empty for other studies, or if factors, levels or answers were changed.
///
/// # Errors
/// A record that cannot be analysed yet.
pub fn rows(study: &StudyRecord) -> anyhow::Result<Vec<Row>> {
    let ready = ReadyProtocol::of(&study.protocol);
    let ready = ready.filter(|ready| ready.is_comparable(&study.protocol));
    Ok(match ready {
        None => Vec::new(),
        Some(ReadyProtocol::Experiment1) => first_rows(study)?,
        Some(ReadyProtocol::Experiment2) => question_rows(study)?,
        Some(ReadyProtocol::Preliminary) => {
            Magnitudes::of(study)?.rows([NOT_HERE; 3], ["drawn (V-8)"; 2])
        }
        Some(ReadyProtocol::Cones) => {
            Magnitudes::of(study)?.rows([NOT_HERE; 3], ["drawn (V-13)"; 2])
        }
        Some(ReadyProtocol::Roughness) => {
            let found = Magnitudes::of(study)?;
            let mut rows = found.rows(TABLE_V, ORDERS);
            let told_apart = found.distinct().to_string();
            rows.push(Row::new("levels told apart", LEVELS, told_apart));
            rows
        }
    })
}

/// The section of a study's report that compares it with the dissertation; empty for other studies, and for studies without enough answers.
pub(super) fn section(study: &StudyRecord) -> String {
    let rows = rows(study).unwrap_or_default();
    if rows.is_empty() {
        return String::new();
    }
    let table = Row::table(&rows);
    let mut text = format!("\n## Beside the dissertation\n\n{table}");
    if let (Procedure::Magnitude, Ok(found)) = (study.protocol.procedure, Magnitudes::of(study)) {
        text += "\nIn the form of table V, with one residual for all effects:\n\n";
        text += &found.table_v().to_string();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sets, p and medians by `scipy.stats.permutation_test` (1.17.1) over all sets of answers.
    #[test]
    fn published_means_leave_open_what_was_found() {
        for (mean, sets, most_p) in [(4.125, 11, 0.125), (4.25, 9, 0.125), (4.375, 6, 0.0703125)] {
            let found = possible(mean).unwrap();
            assert_eq!((found.sets, found.p), (sets, [0.0078125, most_p]));
            assert_eq!(found.median, [4.0, 5.0]);
        }
        assert!(possible(4.3).is_err() && possible(5.5).is_err() && possible(f64::NAN).is_err());
    }

    #[test]
    fn the_experiments_are_put_beside_what_was_published() {
        let of = |ready| rows(&redone(ready, 8, 3).unwrap()).unwrap();
        let first = of(ReadyProtocol::Experiment1);
        let ours = |what: &str| &first.iter().find(|r| r.what.contains(what)).unwrap().ours;
        assert_eq!(ours("subjects"), "8");
        let too_many = ("0.6 ", "too many");
        for (share, needed) in [too_many, ("0.75", "35"), ("0.9 ", "12"), ("0.95", "9")] {
            assert!(ours(share).starts_with(needed), "{first:?}");
        }
        let second = of(ReadyProtocol::Experiment2);
        assert_eq!(second.len(), 3 * 4);
        assert!(second[3].ours.starts_with("11 "), "{second:?}");
        let means = second.iter().filter(|row| row.what.ends_with(", mean"));
        let means: Vec<f64> = means.map(|row| row.ours.parse().unwrap()).collect();
        assert_eq!(means.len(), 3);
        assert!(means.iter().all(|mean| *mean > 3.5), "{means:?}");
        // Nobody has answered.
        let nobody = StudyRecord {
            trials: Vec::new(),
            ..redone(ReadyProtocol::Experiment2, 2, 1).unwrap()
        };
        assert!(rows(&nobody).is_err() && section(&nobody).is_empty());
    }

    /// Table V has the published degrees of freedom, and its orders are reproduced.
    #[test]
    fn the_study_of_roughness_is_put_beside_table_v() {
        let record = redone(ReadyProtocol::Roughness, 25, 3).unwrap();
        let rows = rows(&record).unwrap();
        let named = |what: &str| rows.iter().find(|row| row.what.starts_with(what)).unwrap();
        assert_eq!(named("angle, ").what, "angle, F(4, 576)");
        assert!(named("angle, ").published.starts_with("71.667"));
        assert_eq!(named("angle:speed").what, "angle:speed, F(16, 576)");
        let found = Magnitudes::of(&record).unwrap();
        let angles = found.groups.iter().find(|g| g.factor == "angle").unwrap();
        assert!(angles.is_less("0", "45") && angles.is_less("45", "63.43"));
        assert!(!angles.is_less("63.43", "90") && found.distinct() >= 6);
        assert_eq!(found.analysis.cells.len(), 25);
        let text = found.table_v().to_string();
        assert!(text.contains("error") && text.contains("576"), "{text}");
        assert!(section(&record).contains("Beside the dissertation"));
    }

    #[test]
    fn the_studies_of_patches_have_curves_in_their_order() {
        for (ready, patches) in [
            (
                ReadyProtocol::Preliminary,
                &["study-1.5", "study-2", "study-2.5", "study-3"][..],
            ),
            (ReadyProtocol::Cones, &["study-3", "cones-3"]),
        ] {
            let found = Magnitudes::of(&redone(ready, 8, 3).unwrap()).unwrap();
            let factor = &found.analysis.design.within[1];
            assert_eq!(factor.name, "patch");
            assert_eq!(factor.levels, patches);
            assert_eq!(found.analysis.cells.len(), 5 * patches.len());
        }
    }
}
