//! The dissertation's studies redone, beside what was published.
//!
//! One function for each study (`experiment_1`, ...) runs its protocol with simulated participants and returns its result. From any
//! record of such a study, also one with people, [`rows`] makes the rows of published numbers and its own,
//! [`figures`](super::outputs::figures) the figures.

use crate::report::{or_none, titled};
use anyhow::{Context, bail};
use hwall_psychophysics::{
    Analysis, CellMean, ErrorModel, for_each_outcome, median, sign_test, wilcoxon_signed_rank_exact,
};
use hwall_study::{
    Durability, EXPERIMENT_2_MEANS, LevelGroups, Participants, RatingPower, Ratings, ReadyProtocol,
    SimulatedStage, Simulation, Study, StudyRecord, StudyReport, mean_power, planted_for, ratings,
    sign_power, simulate,
};
use hwall_testkit::MarkdownTable;

/// Subjects and points of the scales of the dissertation's two experiments.
const SUBJECTS: usize = 8;
const POINTS: usize = 5;
/// Shares of people who prefer one wall, for which the power is given.
const SHARES: [f64; 4] = [0.6, 0.75, 0.9, 0.95];

/// A published number and the one of the study that was redone.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What it is.
    pub what: String,
    /// As published, with the place; or why there is none.
    pub published: String,
    /// Of the redone study.
    pub ours: String,
}

impl Row {
    fn new(what: impl Into<String>, published: impl Into<String>, ours: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            published: published.into(),
            ours: ours.into(),
        }
    }
}

/// Why there is no published number: none of the sources of this project gives it.
const NOT_HERE: &str = "not among this project's sources";

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

/// Result of experiment 1: a whiteboard against H-Wall.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment1 {
    /// The answers; high ones speak for H-Wall.
    pub answers: Ratings,
    /// Power of the published number of subjects, and how many it takes, by the share of those who prefer one wall.
    pub power: Vec<RatingPower>,
}

/// Experiment 1 with simulated participants, who find no wall more real.
///
/// # Errors
/// As [`redone`].
pub fn experiment_1(subjects: usize, seed: u64) -> anyhow::Result<Experiment1> {
    Experiment1::of(&redone(ReadyProtocol::Experiment1, subjects, seed)?)
}

impl Experiment1 {
    /// The result of a record.
    ///
    /// # Errors
    /// A record without an answer.
    pub fn of(study: &StudyRecord) -> anyhow::Result<Self> {
        let answers = ratings(study)?.into_iter().next();
        Ok(Self {
            answers: answers.context("nobody has answered")?,
            power: sign_power(&SHARES, SUBJECTS)?,
        })
    }

    /// Its rows.
    #[must_use]
    pub fn rows(&self) -> Vec<Row> {
        let a = &self.answers;
        let share = a.above.map_or("nobody decided".to_owned(), |s| {
            format!(
                "{} of {} ({:.3} to {:.3})",
                s.successes, s.trials, s.ci[0], s.ci[1]
            )
        });
        let mut rows = vec![
            Row::new("subjects", SUBJECTS.to_string(), a.subjects.to_string()),
            Row::new(
                "possible answers",
                POINTS.to_string(),
                a.counts.len().to_string(),
            ),
            Row::new("H-Wall more real, of the decided", NOT_HERE, share),
            Row::new("sign test, p", NOT_HERE, format!("{:.4}", a.signs.p)),
        ];
        for decided in [SUBJECTS, SUBJECTS - 1] {
            let mut signs = vec![1.0; decided];
            signs.resize(SUBJECTS, -1.0);
            let p = sign_test(&signs).map(|test| test.p);
            let what = format!("sign test, p if {decided} of {SUBJECTS} agree");
            rows.push(Row::new(what, "not given", or_none(p, 4)));
        }
        for power in &self.power {
            let what = format!(
                "people for a power of 0.8 if {} prefer one wall",
                power.population
            );
            let needed = power
                .subjects
                .map_or("above 200".to_owned(), |n| n.to_string());
            let ours = format!("{needed} (power of {SUBJECTS}: {:.3})", power.power);
            rows.push(Row::new(what, "not given", ours));
        }
        rows
    }
}

/// What every possible set of answers with a published mean would have shown.
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
    let mut found: Option<Possible> = None;
    let mut failed = Ok(());
    for_each_outcome(POINTS, SUBJECTS, |counts| {
        let points = (1..).zip(counts);
        let points = points.flat_map(|(point, n)| std::iter::repeat_n(f64::from(point), *n));
        let answers: Vec<f64> = points.collect();
        // Sums of small whole numbers are exact.
        let off_by = answers.iter().sum::<f64>() - mean * SUBJECTS as f64;
        let fits = off_by.abs() <= 1e-9;
        if !fits {
            return;
        }
        let off: Vec<f64> = answers
            .iter()
            .map(|a| a - 0.5 * (POINTS as f64 + 1.0))
            .collect();
        let p = wilcoxon_signed_rank_exact(&off).map_or(1.0, |test| test.p);
        match median(&answers, 0.95) {
            Ok(middle) => {
                let one = found.get_or_insert(Possible {
                    sets: 0,
                    p: [p; 2],
                    median: [middle.value; 2],
                });
                one.sets += 1;
                one.p = [one.p[0].min(p), one.p[1].max(p)];
                let m = middle.value;
                one.median = [one.median[0].min(m), one.median[1].max(m)];
            }
            Err(error) => failed = Err(error),
        }
    })?;
    failed?;
    found.with_context(|| format!("eight answers from 1 to 5 never have the mean {mean}"))
}

/// A question of experiment 2.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// The published mean of eight answers.
    pub published_mean: f64,
    /// What the published answers can have been.
    pub possible: Possible,
    /// Power of the published number of subjects, and how many it takes, for a population with the published mean.
    pub power: RatingPower,
    /// The answers of this study.
    pub answers: Ratings,
}

/// Experiment 2, three questions about H-Wall, with simulated participants who have the published means planted.
///
/// # Errors
/// As [`redone`].
pub fn experiment_2(subjects: usize, seed: u64) -> anyhow::Result<Vec<Question>> {
    questions_of(&redone(ReadyProtocol::Experiment2, subjects, seed)?)
}

/// The questions of a record of experiment 2.
///
/// # Errors
/// A record that lacks answers to one of the questions.
pub fn questions_of(study: &StudyRecord) -> anyhow::Result<Vec<Question>> {
    let answers = ratings(study)?;
    if answers.len() != EXPERIMENT_2_MEANS.len() {
        bail!(
            "{} of {} questions have an answer",
            answers.len(),
            EXPERIMENT_2_MEANS.len()
        );
    }
    let power = mean_power(POINTS as u8, &EXPERIMENT_2_MEANS, SUBJECTS)?;
    let of = |(power, answers): (RatingPower, Ratings)| {
        Ok(Question {
            published_mean: power.population,
            possible: possible(power.population)?,
            power,
            answers,
        })
    };
    power.into_iter().zip(answers).map(of).collect()
}

fn question_rows(questions: &[Question]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (number, q) in (1..).zip(questions) {
        let [low, high] = q.possible.median;
        let [least, most] = q.possible.p;
        let ci = q.answers.median.ci.map(|[a, b]| format!(" ({a} to {b})"));
        rows.push(Row::new(
            format!("question {number}, mean"),
            format!("{}", q.published_mean),
            format!("{:.3}", q.answers.mean),
        ));
        rows.push(Row::new(
            format!("question {number}, median"),
            format!("{low} to {high}, by its mean"),
            format!("{}{}", q.answers.median.value, ci.unwrap_or_default()),
        ));
        rows.push(Row::new(
            format!("question {number}, signed ranks against 3, p"),
            format!(
                "{least:.4} to {most:.4}, by its mean ({} sets)",
                q.possible.sets
            ),
            or_none(q.answers.wilcoxon.map(|w| w.p), 4),
        ));
        let needed = q
            .power
            .subjects
            .map_or("above 40".to_owned(), |n| n.to_string());
        rows.push(Row::new(
            format!("people for a power of 0.8 at the mean {}", q.published_mean),
            "not given",
            format!("{needed} (power of {SUBJECTS}: {:.3})", q.power.power),
        ));
    }
    rows
}

/// Result of a study of magnitudes.
#[derive(Debug, Clone, PartialEq)]
pub struct Magnitudes {
    /// Analysis of the normalised estimates, with both error models.
    pub analysis: Analysis,
    /// Levels of each factor in groups that do not differ.
    pub groups: Vec<LevelGroups>,
}

/// The preliminary study (V-5, V-8) with simulated participants: normalised estimates of four patches by scanning angle.
///
/// # Errors
/// As [`redone`].
pub fn preliminary(subjects: usize, seed: u64) -> anyhow::Result<Magnitudes> {
    Magnitudes::of(&redone(ReadyProtocol::Preliminary, subjects, seed)?)
}

/// The study of roughness (V-10, V-11, table V) with simulated participants.
///
/// # Errors
/// As [`redone`].
pub fn roughness(subjects: usize, seed: u64) -> anyhow::Result<Magnitudes> {
    Magnitudes::of(&redone(ReadyProtocol::Roughness, subjects, seed)?)
}

/// Hemiellipsoids against truncated cones (V-12, V-13) with simulated participants.
///
/// # Errors
/// As [`redone`].
pub fn cones(subjects: usize, seed: u64) -> anyhow::Result<Magnitudes> {
    Magnitudes::of(&redone(ReadyProtocol::Cones, subjects, seed)?)
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

    /// How many levels of roughness the answers tell apart: by each factor the levels that differ from each other, multiplied. This is
    /// our reading of the dissertation's nine.
    #[must_use]
    pub fn distinct(&self) -> usize {
        self.groups.iter().map(distinct).product()
    }

    /// The normalised estimates of V-8 and V-13: means of the conditions, the last factor fastest.
    #[must_use]
    pub fn estimates(&self) -> &[CellMean] {
        &self.analysis.cells
    }

    /// The analysis of variance in the form of table V: one residual for all effects.
    #[must_use]
    pub fn table_v(&self) -> MarkdownTable {
        let effects = &self.analysis.effects;
        let pooled = effects.iter().filter(|e| e.errors == ErrorModel::Pooled);
        let mut table = titled(
            "source | sum of squares | degrees of freedom | mean square | F | p | partial eta squared",
        );
        for e in pooled.clone() {
            let p = e.p.map_or("none".to_owned(), probability);
            table.row([
                e.name.clone(),
                format!("{:.3}", e.ss),
                e.df1.to_string(),
                format!("{:.3}", e.ss / e.df1 as f64),
                or_none(e.f.finite(), 3),
                p,
                or_none(e.partial_eta2, 4),
            ]);
        }
        if let Some(e) = pooled.last() {
            let mean = e.ss_error / e.df2 as f64;
            let [ss, df, mean] = [
                format!("{:.3}", e.ss_error),
                e.df2.to_string(),
                format!("{mean:.3}"),
            ];
            table.row([
                "error".to_owned(),
                ss,
                df,
                mean,
                String::new(),
                String::new(),
                String::new(),
            ]);
        }
        table
    }

    /// Rows of the study of roughness: table V.
    fn table_v_rows(&self) -> Vec<Row> {
        /// Effect of table V, F, what else was published, degrees of freedom.
        const PUBLISHED: [(&str, f64, &str); 3] = [
            ("orientation", 71.667, "partial eta squared .3323"),
            ("velocity", 15.873, "partial eta squared .0993"),
            ("orientation:velocity", 0.437, "p = .9726"),
        ];
        let effects = self.analysis.effects.iter();
        let pooled = effects.filter(|e| e.errors == ErrorModel::Pooled);
        let mut rows: Vec<Row> = PUBLISHED
            .iter()
            .zip(pooled)
            .map(|((name, f, more), e)| {
                let ours = match e
                    .p
                    .filter(|_| more.starts_with('p') && !more.contains("eta"))
                {
                    Some(p) => format!("p = {p:.4}"),
                    None => format!("partial eta squared {}", or_none(e.partial_eta2, 4)),
                };
                Row::new(
                    format!("{name}, F({}, {})", e.df1, e.df2),
                    format!("{f:.3}, {more} (table V)"),
                    format!("{}, {ours}", or_none(e.f.finite(), 3)),
                )
            })
            .collect();
        rows.push(Row::new(
            "order of orientations",
            "0 < 45 < 63.43 ~ 71.57 ~ 90 (V-10)",
            self.order("angle"),
        ));
        rows.push(Row::new(
            "order of velocities",
            "rises, 0 to 80 mm/s (V-11)",
            self.order("speed"),
        ));
        rows.push(Row::new(
            "levels told apart",
            "at least 9",
            self.distinct().to_string(),
        ));
        rows
    }

    /// Rows of the studies of patches, of which no number is among this project's sources.
    fn patch_rows(&self, figure: &str) -> Vec<Row> {
        let effects = self.analysis.effects.iter();
        let pooled = effects.filter(|e| e.errors == ErrorModel::Pooled);
        let mut rows: Vec<Row> = pooled
            .map(|e| {
                let p = e.p.map_or("none".to_owned(), probability);
                let ours = format!("{}, p = {p}", or_none(e.f.finite(), 2));
                Row::new(
                    format!("{}, F({}, {})", e.name, e.df1, e.df2),
                    NOT_HERE,
                    ours,
                )
            })
            .collect();
        let drawn = format!("drawn ({figure})");
        rows.push(Row::new(
            "order of angles",
            drawn.clone(),
            self.order("angle"),
        ));
        rows.push(Row::new("order of patches", drawn, self.order("patch")));
        rows
    }

    fn order(&self, factor: &str) -> String {
        let own = self.groups.iter().find(|g| g.factor == factor);
        own.map_or("none".to_owned(), LevelGroups::to_text)
    }
}

fn probability(p: f64) -> String {
    if p >= 1e-4 {
        format!("{p:.4}")
    } else {
        format!("{p:.1e}")
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

/// Rows of a record of one of the dissertation's studies; none of another study.
///
/// # Errors
/// A record that cannot be analysed yet.
pub fn rows(study: &StudyRecord) -> anyhow::Result<Vec<Row>> {
    Ok(match ReadyProtocol::of(&study.protocol) {
        None => Vec::new(),
        Some(ReadyProtocol::Experiment1) => Experiment1::of(study)?.rows(),
        Some(ReadyProtocol::Experiment2) => question_rows(&questions_of(study)?),
        Some(ReadyProtocol::Preliminary) => Magnitudes::of(study)?.patch_rows("V-8"),
        Some(ReadyProtocol::Cones) => Magnitudes::of(study)?.patch_rows("V-13"),
        Some(ReadyProtocol::Roughness) => Magnitudes::of(study)?.table_v_rows(),
    })
}

/// The section of a study's report beside the dissertation; empty for another study, and for one without enough answers.
pub(super) fn section(study: &StudyRecord) -> String {
    let Some(ready) = ReadyProtocol::of(&study.protocol) else {
        return String::new();
    };
    let Ok(rows) = rows(study) else {
        return String::new();
    };
    let mut table = titled("number | the dissertation | this study");
    for row in rows {
        table.row([row.what, row.published, row.ours]);
    }
    let mut text = format!("\n## Beside the dissertation\n\n{table}");
    let magnitudes = match ready {
        ReadyProtocol::Experiment1 | ReadyProtocol::Experiment2 => None,
        _ => Magnitudes::of(study).ok(),
    };
    if let Some(magnitudes) = magnitudes {
        text += &format!(
            "\nIn the form of table V, with one residual for all effects:\n\n{}",
            magnitudes.table_v()
        );
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
    fn the_experiments_have_typed_results() {
        let first = experiment_1(8, 3).unwrap();
        assert_eq!(first.answers.subjects, 8);
        let needed: Vec<_> = first.power.iter().map(|p| p.subjects).collect();
        assert_eq!(needed, [None, Some(35), Some(12), Some(9)]);
        let second = experiment_2(8, 3).unwrap();
        assert_eq!(second.len(), 3);
        assert_eq!(second[0].power.subjects, Some(11));
        assert!(second.iter().all(|q| q.answers.mean > 3.5));
        // Nobody has answered.
        let nobody = StudyRecord {
            trials: Vec::new(),
            ..redone(ReadyProtocol::Experiment2, 2, 1).unwrap()
        };
        assert!(rows(&nobody).is_err() && section(&nobody).is_empty());
    }

    /// Table V has the published degrees of freedom, and its orders come back.
    #[test]
    fn the_study_of_roughness_is_put_beside_table_v() {
        let record = redone(ReadyProtocol::Roughness, 25, 3).unwrap();
        let rows = rows(&record).unwrap();
        let named = |what: &str| rows.iter().find(|row| row.what.starts_with(what)).unwrap();
        assert_eq!(named("orientation, ").what, "orientation, F(4, 576)");
        assert!(named("orientation, ").published.starts_with("71.667"));
        assert_eq!(
            named("orientation:velocity").what,
            "orientation:velocity, F(16, 576)"
        );
        let found = Magnitudes::of(&record).unwrap();
        let angles = found.groups.iter().find(|g| g.factor == "angle").unwrap();
        assert!(angles.is_less("0", "45") && angles.is_less("45", "63.43"));
        assert!(!angles.is_less("63.43", "90") && found.distinct() >= 6);
        assert_eq!(found.estimates().len(), 25);
        let text = found.table_v().to_string();
        assert!(text.contains("error") && text.contains("576"), "{text}");
        assert!(section(&record).contains("Beside the dissertation"));
    }

    #[test]
    fn the_studies_of_patches_have_curves_in_their_order() {
        for (found, patches) in [
            (
                preliminary(8, 3).unwrap(),
                &["study-1.5", "study-2", "study-2.5", "study-3"][..],
            ),
            (cones(8, 3).unwrap(), &["study-3", "cones-3"]),
        ] {
            let factor = &found.analysis.design.within[1];
            assert!(
                factor.name == "patch" && factor.levels == patches,
                "{factor:?}"
            );
            assert_eq!(found.estimates().len(), 5 * patches.len());
        }
    }
}
