//! Estimators of where a reach ends: time of a sample against how far off the end is foreseen.

use crate::contact::candidates::{self, Candidate, Role};
use crate::contact::run;
use crate::contact::scores::{REGIONS, Scores};
use crate::demonstrations::generate::{
    DemonstrationConfig, Part, PartSize, SimulatedReach, generate,
};
use crate::speed::page::multiples::{Axis, Line, Panel, Point};
use crate::speed::page::section::{Figure, Section, SummaryRow};
use anyhow::Context;
use hwall_contact::score::Moment;
use hwall_contact::score::{Fold, Split};
use hwall_hand::LabelledReach;
use hwall_testkit::{MarkdownTable, Timing, format_ns};
use std::sync::Mutex;
use std::time::Instant;

/// Every row is measured in this many worlds, each with people of its own.
const WORLDS: u64 = 2;
/// Demonstrations, unless their number is what is varied; as in the dissertation.
pub(super) const DEMONSTRATIONS: usize = 47;
/// Shares of the time of a reach at which it is judged.
pub(super) const SHARES: [f64; 3] = [0.5, 0.7, 0.9];
/// The tables' heading for errors at those shares.
pub(super) const AT: &str = "median error at 50 / 70 / 90 %, mm";

/// Reaches of some people to learn from, and of others to be judged by.
pub(super) struct World {
    train: Vec<LabelledReach>,
    test: Vec<LabelledReach>,
}

impl World {
    /// The dissertation's panel: 400 reaches of 50 people, of which mostly the first are learnt
    /// from, and 60 of 10 others.
    fn new(seed: u64) -> anyhow::Result<Self> {
        let made = generate(&DemonstrationConfig {
            seed,
            train: PartSize {
                people: 50,
                reaches: 400,
            },
            test: PartSize {
                people: 10,
                reaches: 60,
            },
            arm_reaction_s: None,
            ..DemonstrationConfig::dissertation()
        })?;
        let (train, test): (Vec<_>, Vec<_>) = made.into_iter().partition(|d| d.part == Part::Train);
        let reaches = |made: Vec<SimulatedReach>| made.into_iter().map(|d| d.labelled).collect();
        Ok(Self {
            train: reaches(train),
            test: reaches(test),
        })
    }

    /// As a slower tracker sees it: one sample in `samples`.
    pub(super) fn every(&self, samples: usize) -> Self {
        let thinned = |reaches: &[LabelledReach]| {
            reaches
                .iter()
                .map(|r| LabelledReach {
                    frames: r.frames.iter().step_by(samples).copied().collect(),
                    ..r.clone()
                })
                .collect()
        };
        Self {
            train: thinned(&self.train),
            test: thinned(&self.test),
        }
    }
}

pub(super) fn worlds(seed: u64) -> anyhow::Result<Vec<World>> {
    (seed..seed + WORLDS).map(World::new).collect()
}

/// One estimator over the reaches of all worlds.
pub(super) struct Run {
    scores: Scores,
    pub(super) timing: Timing,
    /// Mean time of training, s.
    pub(super) train_s: f64,
}

impl Run {
    /// Trains on the first `reaches` reaches of every world and estimates those held out.
    pub(super) fn of(
        candidate: &Candidate,
        worlds: &[World],
        reaches: usize,
    ) -> anyhow::Result<Self> {
        let mut pooled: Option<Scores> = None;
        let mut train_s = 0.0;
        for world in worlds {
            let train = &world.train[..reaches];
            let clock = Instant::now();
            let trained = (candidate.train)(&train.iter().collect::<Vec<_>>())
                .with_context(|| candidate.name.clone())?;
            train_s += clock.elapsed().as_secs_f64() / worlds.len() as f64;
            // Handed over to the one fold below, so that training is timed here.
            let trained = Mutex::new(Some(trained));
            let ready = Candidate {
                name: candidate.name.clone(),
                role: Role::Learned,
                train: Box::new(move |_| {
                    let mut trained = trained.lock().ok().context("an estimator")?;
                    trained.take().context("one fold")
                }),
            };
            let split = Split {
                description: String::new(),
                folds: vec![Fold {
                    train: Vec::new(),
                    test: (0..world.test.len()).collect(),
                }],
            };
            let scores = run::run(&ready, &world.test, &split, None)?;
            match &mut pooled {
                None => pooled = Some(scores),
                Some(pooled) => {
                    for (all, more) in pooled.errors.iter_mut().zip(scores.errors) {
                        all.extend(more);
                    }
                    pooled.step_us.extend(scores.step_us);
                }
            }
        }
        let scores = pooled.context("no worlds")?;
        let timing = Timing::from_samples_ns(scores.step_us.iter().map(|us| 1e3 * us).collect());
        Ok(Self {
            scores,
            timing,
            train_s,
        })
    }

    pub(super) fn median_mm(&self, share: f64) -> f64 {
        1e3 * self.scores.at_moment(Moment::Share(share)).median_m
    }

    /// Times and errors for a table; [`columns`] names them.
    pub(super) fn cells(&self) -> [String; 6] {
        let all = self.scores.under_way();
        // The second last of the regions is that of 90 %.
        let held = all.regions.map(|r| r[REGIONS.len() - 2]);
        [
            format_ns(self.timing.median_ns),
            format_ns(self.timing.p99_ns),
            format_ns(1e9 * self.train_s),
            SHARES
                .map(|s| format!("{:.1}", self.median_mm(s)))
                .join(" / "),
            format!("{:.1}", 1e3 * all.crps_m),
            held.map_or("none".to_owned(), |held| format!("{:.0} %", 100.0 * held)),
        ]
    }
}

pub(super) fn columns(first: &[&str]) -> Vec<String> {
    let rest = [
        "median",
        "p99",
        "training",
        AT,
        "CRPS, mm",
        "90 % regions hold",
    ];
    first
        .iter()
        .chain(&rest)
        .map(|&name| name.to_owned())
        .collect()
}

/// Every estimator of where a reach ends.
///
/// # Errors
/// Whatever making demonstrations and training refuse.
pub fn estimators(seed: u64) -> anyhow::Result<Section> {
    let worlds = worlds(seed)?;
    let mut table = MarkdownTable::new(columns(&["estimator"]));
    let (mut lines, mut quoted) = (Vec::new(), Vec::new());
    let mut all = candidates::all(hwall_contact::LearnedConfig::default());
    all.retain(|c| c.role != Role::Bound);
    for candidate in &all {
        let run = Run::of(candidate, &worlds, DEMONSTRATIONS)?;
        let mut cells = vec![candidate.name.clone()];
        cells.extend(run.cells());
        table.row(cells);
        let point = |share: f64| Point {
            at: (run.median_mm(share), run.timing.median_ns),
            up_to: Some(run.timing.p99_ns),
            ..Point::default()
        };
        lines.push(Line {
            name: candidate.name.clone(),
            points: SHARES.map(point).to_vec(),
        });
        quoted = vec![SummaryRow::new(
            "contact",
            "where and when a reach ends, 47 demonstrations",
            &run.timing,
            format!(
                "{:.0} mm (median) at 70 %, {:.0} mm at 90 % of it",
                run.median_mm(0.7),
                run.median_mm(0.9)
            ),
        )];
    }
    let title =
        "Where a reach ends: time of a sample against median error at 50, 70, 90 % (right to left)";
    Ok(Section {
        text: format!(
            "### Estimators of where a reach ends\n\n{} CRPS: of a coordinate, from 30 to 90 % of the time; \
             without a covariance the absolute error. Single calls, the clock included.\n\n{table}",
            people(seed)
        ),
        figure: Some(Figure::panels(
            "contact_estimators.svg",
            title,
            1,
            vec![Panel {
                title: String::new(),
                axes: [
                    Axis::Number("median error, mm"),
                    Axis::Time("time per sample: median (dot) to p99 (bar)"),
                ],
                lines,
            }],
        )),
        summary: quoted,
    })
}

pub(super) fn people(seed: u64) -> String {
    format!(
        "Simulated people and the dissertation's panel; {DEMONSTRATIONS} reaches of 6 people to learn from unless said \
         otherwise, 60 of 10 others to be judged by, in {WORLDS} such worlds together (seeds {seed} to {}).",
        seed + WORLDS - 1
    )
}
