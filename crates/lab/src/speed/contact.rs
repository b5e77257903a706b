//! Contact prediction, time against error: estimators of the end of a reach, and their fusion with gaze and surfaces.

use crate::contact::candidates::{self, Candidate};
use crate::contact::run::{Scores, first_learnt, run};
use crate::demonstrations::generate::{DemonstrationConfig, Part, PartSize, generate};
use crate::rooms::people::{self, Condition, StudyPeople, StudySize};
use crate::rooms::room::Room;
use crate::rooms::scores::summary;
use crate::speed::section::{Section, median_and_p99, quoted};
use anyhow::Context;
use hwall_contact::score::Moment;
use hwall_contact::{FusedConfig, FusedPredictor, LearnedConfig, LearnedModel};
use hwall_hand::LabelledReach;
use hwall_stage::training;
use hwall_testkit::{Timing, format_ns, titled};

/// Number of worlds per row, each with different people.
const WORLDS: u64 = 2;
/// Number of demonstrations, as in the dissertation.
const DEMONSTRATIONS: usize = 47;
/// Shares of the time of a reach at which it is evaluated.
const SHARES: [f64; 3] = [0.5, 0.7, 0.9];
/// The tables' heading for errors at those shares.
const AT: &str = "median error at 50 / 70 / 90 %, mm";

/// The dissertation's panel: 400 training reaches of 50 people (the first ones are used), then 60 of 10 others.
fn world(seed: u64) -> anyhow::Result<Vec<LabelledReach>> {
    let size = |people, reaches| PartSize { people, reaches };
    let made = generate(&DemonstrationConfig {
        seed,
        train: size(50, 400),
        test: size(10, 60),
        ..DemonstrationConfig::dissertation()
    })?;
    let part = |part: Part| made.iter().filter(move |d| d.part == part);
    let used = part(Part::Train)
        .take(DEMONSTRATIONS)
        .chain(part(Part::Test));
    Ok(used.map(|d| d.labelled.clone()).collect())
}

/// Trains on the first reaches of every world and estimates those held out; the scores of all, and the mean time of training, s.
fn pooled(candidate: &Candidate, worlds: &[Vec<LabelledReach>]) -> anyhow::Result<(Scores, f64)> {
    let mut pooled: Option<Scores> = None;
    let mut train_s = 0.0;
    for reaches in worlds {
        let split = first_learnt(DEMONSTRATIONS, reaches.len());
        let scores = run(candidate, reaches, &split, None);
        let scores = scores.with_context(|| candidate.name.clone())?;
        train_s += scores.training.map_or(0.0, |t| t.took_s) / worlds.len() as f64;
        match &mut pooled {
            None => pooled = Some(scores),
            Some(pooled) => {
                pooled.alone.reaches.extend(scores.alone.reaches);
                pooled.step_us.extend(scores.step_us);
            }
        }
    }
    Ok((pooled.context("no worlds")?, train_s))
}

/// Every estimator of where a reach ends.
///
/// # Errors
/// Errors of generating demonstrations and of training.
pub fn estimators(seed: u64) -> anyhow::Result<Section> {
    let seeds = seed..seed + WORLDS;
    let worlds: Vec<_> = seeds.map(world).collect::<anyhow::Result<_>>()?;
    let mut table = titled(&format!(
        "estimator | median | p99 | training | {AT} | CRPS, mm | 90 % regions hold"
    ));
    let mut summary = Vec::new();
    for candidate in &candidates::all(LearnedConfig::default()) {
        let (scores, train_s) = pooled(candidate, &worlds)?;
        let timing = scores.step_us.iter().map(|us| 1e3 * us).collect();
        let timing = Timing::from_samples_ns(timing);
        let medians_mm = SHARES.map(|s| 1e3 * scores.at_moment(Moment::Share(s)).median_m);
        let all = scores.under_way();
        let [median, p99] = median_and_p99(&timing);
        table.row([
            candidate.name.clone(),
            median,
            p99,
            format_ns(1e9 * train_s),
            medians_mm.map(|mm| format!("{mm:.1}")).join(" / "),
            format!("{:.1}", 1e3 * all.crps_m),
            all.covered()
                .map_or("none".to_owned(), |held| format!("{:.0} %", 100.0 * held)),
        ]);
        let [_, late, last] = medians_mm;
        let error = format!("{late:.0} mm (median) at 70 %, {last:.0} mm at 90 % of it");
        let what = "where and when a reach ends, 47 demonstrations";
        summary = vec![quoted("contact", what, &timing, error)];
    }
    Section::of(include_str!("text/estimators.md"), summary).filled(&[
        ("demonstrations", &DEMONSTRATIONS),
        ("worlds", &WORLDS),
        ("first", &seed),
        ("last", &(seed + WORLDS - 1)),
        ("table", &table),
    ])
}

/// Fusion with gaze and surfaces, in rooms with increasing numbers of surfaces.
///
/// # Errors
/// Errors of training and prediction.
pub fn fusion(seed: u64) -> anyhow::Result<Section> {
    let condition = Condition::nominal();
    let size = StudySize {
        participants: 16,
        seed,
        ..StudySize::default()
    };
    let mut table = titled(&format!(
        "touchable surfaces | median | p99 | right surface at 50 / 70 / 90 %, % | {AT}"
    ));
    let mut summary_rows = Vec::new();
    for count in [1, 6, 12] {
        let room = Room::new(count)?;
        let StudyPeople {
            training: train,
            participants,
        } = people::people(&room, &condition, &size)?;
        let reaches = training::reaches(&train)?;
        let estimator = LearnedModel::train(&reaches, &LearnedConfig::default())?.estimator();
        let config = FusedConfig {
            evidence: training::evidence_model(&train, |_| estimator.clone())?,
            ..FusedConfig::default()
        };
        let mut predictor = FusedPredictor::new(estimator, config)?;
        let touches = people::predictions(&mut predictor, &room, &participants)?;
        let samples = touches.iter().flat_map(|t| &t.samples);
        let timing = Timing::from_samples_ns(samples.map(|s| 1e3 * s.took_us).collect());
        let at = SHARES.map(|share| summary(&touches, Moment::Share(share)));
        let right = at.map(|s| 100.0 * s.right);
        let median_mm = at.map(|s| 1e3 * s.median_m);
        let listed = |values: [f64; 3]| values.map(|v| format!("{v:.1}")).join(" / ");
        let [median, p99] = median_and_p99(&timing);
        table.row([
            count.to_string(),
            median,
            p99,
            listed(right),
            listed(median_mm),
        ]);
        if count == 6 {
            let error = format!(
                "{:.0} mm (median), {:.0} % the right surface at 70 % of a reach",
                median_mm[1], right[1]
            );
            let what = "ranked surfaces and points, 6 surfaces";
            summary_rows = vec![quoted("contact", what, &timing, error)];
        }
    }
    Section::of(include_str!("text/fusion.md"), summary_rows).filled(&[
        ("touches", &size.touches),
        ("seed", &seed),
        ("table", &table),
    ])
}
