//! The learned estimator, one knob at a time: error and time by window, rank, demonstrations and more.

use crate::contact::candidates::Candidate;
use crate::speed::contact::estimators::{
    DEMONSTRATIONS, Run, SHARES, World, columns, people, worlds,
};
use crate::speed::page::multiples::{Axis, Line, Panel, Point};
use crate::speed::page::section::{Figure, Section};
use hwall_bip::Basis;
use hwall_contact::{LearnedConfig, LearnedModel};
use hwall_hand::LabelledReach;
use hwall_testkit::MarkdownTable;
use std::rc::Rc;

/// From this many demonstrations on, one world has to do: training takes longest.
const MANY: usize = 400;
/// Knobs in a row of the figure.
const SIDE_BY_SIDE: usize = 2;

/// The learned estimator.
fn candidate(name: &str, config: LearnedConfig) -> Candidate {
    Candidate::of(name, move |reaches: &[&LabelledReach]| {
        Ok(LearnedModel::train(reaches, &config)?.estimator())
    })
}

/// One setting of a knob.
struct Setting {
    value: f64,
    config: LearnedConfig,
    /// Demonstrations.
    reaches: usize,
    /// One sample in this many is kept.
    every: usize,
}

impl Setting {
    fn is_usual(&self) -> bool {
        let Self {
            config,
            reaches,
            every,
            ..
        } = *self;
        config == LearnedConfig::default() && reaches == DEMONSTRATIONS && every == 1
    }

    fn run(&self, knob: &str, worlds: &[World]) -> anyhow::Result<Run> {
        let candidate = candidate(knob, self.config);
        let worlds = match self.reaches {
            MANY.. => &worlds[..1],
            _ => worlds,
        };
        if self.every == 1 {
            return Run::of(&candidate, worlds, self.reaches);
        }
        let thinned: Vec<World> = worlds.iter().map(|w| w.every(self.every)).collect();
        Run::of(&candidate, &thinned, self.reaches)
    }
}

/// The knobs of the learned estimator, each with its settings.
fn knobs() -> Vec<(&'static str, Vec<Setting>)> {
    let usual = LearnedConfig::default();
    let setting = |value: usize, config| Setting {
        value: value as f64,
        config,
        reaches: DEMONSTRATIONS,
        every: 1,
    };
    let of = |values: &[usize], change: &dyn Fn(usize, &mut LearnedConfig)| {
        let with = |&value: &usize| {
            let mut config = usual;
            change(value, &mut config);
            setting(value, config)
        };
        values.iter().map(with).collect::<Vec<_>>()
    };
    vec![
        (
            "regions of progress",
            of(&[1, 4, 8, 16, 32, 64], &|n, c| c.regions = Some(n)),
        ),
        (
            "samples per reach",
            of(&[5, 10, 30, 60], &|n, c| c.samples_per_reach = n),
        ),
        (
            "steps back of the window, each twice the one before",
            of(&[1, 2, 3, 4, 5, 6], &|n, c| c.lags = n),
        ),
        (
            "most directions of the primitive",
            of(&[2, 4, 8, 12, 16, 24, 32, 48], &|n, c| c.rank = n),
        ),
        (
            "basis functions of the primitive",
            of(&[5, 7, 9, 12], &|n, c| {
                c.basis = Basis::normalized_gaussian(n);
            }),
        ),
        (
            "Legendre functions of the primitive",
            of(&[4, 8, 12], &|count, c| {
                c.basis = Basis::Legendre { count };
            }),
        ),
        (
            "demonstrations",
            [12, 24, 47, 100, 400]
                .map(|reaches| Setting {
                    reaches,
                    ..setting(reaches, usual)
                })
                .into(),
        ),
        (
            "period of the tracker, in 1/90 s",
            [1, 2, 4]
                .map(|every| Setting {
                    every,
                    ..setting(every, usual)
                })
                .into(),
        ),
    ]
}

/// The learned estimator, one knob at a time.
///
/// # Errors
/// Whatever making demonstrations and training refuse.
pub fn learned(seed: u64) -> anyhow::Result<Section> {
    let worlds = worlds(seed)?;
    let mut table = MarkdownTable::new(columns(&["knob", "value"]));
    let mut errors = Vec::new();
    // One of the settings of every knob.
    let usual = candidate("learned", LearnedConfig::default());
    let usual = Rc::new(Run::of(&usual, &worlds, DEMONSTRATIONS)?);
    for (knob, settings) in knobs() {
        let mut runs = Vec::new();
        for setting in settings {
            let run = match setting.is_usual() {
                true => Rc::clone(&usual),
                false => Rc::new(setting.run(knob, &worlds)?),
            };
            let mut cells = vec![knob.to_owned(), setting.value.to_string()];
            cells.extend(run.cells());
            table.row(cells);
            runs.push((setting.value, run));
        }
        let line = |share: f64| Line {
            name: format!("at {:.0} %", 100.0 * share),
            points: runs
                .iter()
                .map(|(value, run)| Point {
                    at: (*value, run.median_mm(share)),
                    ..Point::default()
                })
                .collect(),
        };
        errors.push(Panel {
            title: String::new(),
            axes: [Axis::Number(knob), Axis::Number("median error, mm")],
            lines: SHARES.map(line).into(),
        });
    }
    let title = "The learned estimator: error by its knobs (times: see the table)";
    Ok(Section {
        text: format!(
            "### The learned estimator, one knob at a time\n\n{} Both sources, at their defaults but for one knob: 16 regions, 30 samples of a \
             reach, 4 steps back (0.03 s, the next always twice as long: 0.24 s), 9 normalised Gaussians, 24 directions. 12, 24, 47, 100 and 400 demonstrations are of 2, 3, 6, 13 and 50 people; {MANY} in the first world only.\n\n{table}",
            people(seed)
        ),
        figure: Some(Figure::panels(
            "contact_learned.svg",
            title,
            SIDE_BY_SIDE,
            errors,
        )),
        summary: Vec::new(),
    })
}
