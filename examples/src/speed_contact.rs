//! Prediction of contact: time of a sample against how far off the touch is foreseen.

use crate::contact_candidates::{self, Candidate, Role};
use crate::contact_moments::Moment;
use crate::contact_recordings::{Fold, Split};
use crate::contact_rooms::{self, Condition, Room, Stream};
use crate::contact_rooms_scores::{self as rooms_scores, Told};
use crate::contact_scores::{self, Scores};
use crate::demonstrations::{Cast, DemonstrationConfig, Part, generate};
use crate::speed::{Figure, Section, summary};
use crate::speed_contact_figures::{Axis, Line, Panel, Point};
use anyhow::Context;
use hwall_bip::Basis;
use hwall_contact::{
    Combination, ContactPrediction, FusedConfig, FusedPredictor, GazeModel, LabelledReach,
    LearnedConfig, LearnedEstimator, LearnedModel, Predictor, Seen,
};
use hwall_scene::{Scene, SurfaceId};
use hwall_testkit::{MarkdownTable, Timing, format_ns};
use std::rc::Rc;
use std::sync::Mutex;
use std::time::Instant;

/// Every row is of so many worlds, each with people of its own.
const WORLDS: u64 = 2;
/// Demonstrations where something else is varied, as in the dissertation.
const DEMONSTRATIONS: usize = 47;
/// From so many demonstrations on, one world has to do.
const MANY: usize = 400;
/// Shares of the time of a reach at which it is judged.
const SHARES: [f64; 3] = [0.5, 0.7, 0.9];
/// What the tables say of those shares.
const AT: &str = "median error at 50 / 70 / 90 %, mm";
/// A surface that is not among the answers counts as this probable.
const LEAST: f64 = 1e-3;

/// Reaches of some people to learn from, and of others to be judged by.
struct World {
    train: Vec<LabelledReach>,
    test: Vec<LabelledReach>,
}

impl World {
    /// The dissertation's panel: 400 reaches of 50 people, of which mostly the first are learnt
    /// from, and 60 of 10 others.
    fn new(seed: u64) -> anyhow::Result<Self> {
        let cast = |people, reaches| Cast { people, reaches };
        let made = generate(&DemonstrationConfig {
            seed,
            train: cast(50, 400),
            test: cast(10, 60),
            arm_reaction_s: None,
            ..DemonstrationConfig::dissertation()
        })?;
        let (train, test): (Vec<_>, Vec<_>) = made.into_iter().partition(|d| d.part == Part::Train);
        let reaches = |made: Vec<crate::demonstrations::Demonstrated>| {
            made.into_iter().map(|d| d.labelled).collect()
        };
        Ok(Self {
            train: reaches(train),
            test: reaches(test),
        })
    }

    /// As a slower tracker sees it: every so-manieth sample.
    fn every(&self, samples: usize) -> Self {
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

fn worlds(seed: u64) -> anyhow::Result<Vec<World>> {
    (seed..seed + WORLDS).map(World::new).collect()
}

/// One way to foresee the end of a reach, over all worlds.
struct Run {
    scores: Scores,
    timing: Timing,
    /// Mean time of training, s.
    train_s: f64,
}

impl Run {
    /// Trains on the first reaches of every world and follows all that it is judged by.
    fn of(candidate: &Candidate, worlds: &[World], reaches: usize) -> anyhow::Result<Self> {
        let mut pooled: Option<Scores> = None;
        let mut train_s = 0.0;
        for world in worlds {
            let train = &world.train[..reaches];
            let clock = Instant::now();
            let trained = (candidate.train)(train).with_context(|| candidate.name.clone())?;
            train_s += clock.elapsed().as_secs_f64() / worlds.len() as f64;
            let seat = Mutex::new(Some(trained));
            let ready = Candidate {
                name: candidate.name.clone(),
                role: Role::Learned,
                train: Box::new(move |_| {
                    let mut seat = seat.lock().ok().context("a seat")?;
                    seat.take().context("one fold")
                }),
            };
            let split = Split {
                description: String::new(),
                folds: vec![Fold {
                    train: Vec::new(),
                    test: (0..world.test.len()).collect(),
                }],
            };
            let scores = contact_scores::run(&ready, &world.test, &split, None)?;
            match &mut pooled {
                None => pooled = Some(scores),
                Some(pooled) => {
                    for (all, more) in pooled.judged.iter_mut().zip(scores.judged) {
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

    fn median_mm(&self, share: f64) -> f64 {
        1e3 * self.scores.at_moment(Moment::Share(share)).median_m
    }

    /// Times and errors for a table; [`columns`] names them.
    fn cells(&self) -> [String; 6] {
        let all = self.scores.under_way();
        // The second last of the regions is that of 90 %.
        let held = all.regions.map(|r| r[contact_scores::REGIONS.len() - 2]);
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

fn columns(first: &[&str]) -> Vec<String> {
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

/// The learned estimator.
fn candidate(name: &str, config: LearnedConfig) -> Candidate {
    Candidate::of(name, move |reaches: &[LabelledReach]| {
        Ok(LearnedModel::train(reaches, &config)?.estimator())
    })
}

/// Every estimator of where a reach ends.
///
/// # Errors
/// None in practice: the reaches are made here.
pub fn estimators(seed: u64) -> anyhow::Result<Section> {
    let worlds = worlds(seed)?;
    let mut table = MarkdownTable::new(columns(&["estimator"]));
    let (mut lines, mut quoted) = (Vec::new(), Vec::new());
    let mut all = contact_candidates::all();
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
        quoted = vec![summary(
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

fn people(seed: u64) -> String {
    format!(
        "Simulated people and the dissertation's panel; {DEMONSTRATIONS} reaches of 6 people to learn from unless said \
         otherwise, 60 of 10 others to be judged by, in {WORLDS} such worlds together (seeds {seed} to {}).",
        seed + WORLDS - 1
    )
}

/// A setting of a knob: its value, the configuration, demonstrations, and every how-manieth sample.
struct Setting {
    value: f64,
    config: LearnedConfig,
    reaches: usize,
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
        // Training takes longest of all here.
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

/// What can be turned at the learned estimator, one knob at a time.
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
            of(&[1, 4, 8, 16, 32], &|n, c| c.regions = n),
        ),
        (
            "samples per reach",
            of(&[5, 10, 30, 60], &|n, c| c.samples_per_reach = n),
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
/// None in practice: the reaches are made here.
pub fn learned(seed: u64) -> anyhow::Result<Section> {
    let worlds = worlds(seed)?;
    let mut table = MarkdownTable::new(columns(&["knob", "value"]));
    let (mut errors, mut times) = (Vec::new(), Vec::new());
    // Every knob passes through it.
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
        let line = |name: &str, y: &dyn Fn(&Run) -> f64, up: &dyn Fn(&Run) -> Option<f64>| Line {
            name: name.to_owned(),
            points: runs
                .iter()
                .map(|(value, run)| Point {
                    at: (*value, y(run)),
                    up_to: up(run),
                    label: String::new(),
                })
                .collect(),
        };
        errors.push(Panel {
            title: knob.to_owned(),
            axes: [Axis::Number(knob), Axis::Number("median error, mm")],
            lines: SHARES
                .map(|share| {
                    let name = format!("at {:.0} %", 100.0 * share);
                    line(&name, &|run| run.median_mm(share), &|_| None)
                })
                .into(),
        });
        times.push(Panel {
            title: String::new(),
            axes: [Axis::Number(knob), Axis::Time("time")],
            lines: vec![
                line("training", &|run| 1e9 * run.train_s, &|_| None),
                line("a sample, to p99", &|run| run.timing.median_ns, &|run| {
                    Some(run.timing.p99_ns)
                }),
            ],
        });
    }
    // Under the errors of a knob its times, three knobs side by side.
    let mut panels = Vec::new();
    let (mut errors, mut times) = (errors.into_iter(), times.into_iter());
    while errors.len() > 0 {
        panels.extend(errors.by_ref().take(3));
        panels.extend(times.by_ref().take(3));
    }
    let title = "The learned estimator: error and time by its knobs";
    Ok(Section {
        text: format!(
            "### {title}\n\n{} Both sources, at their defaults but for one knob: 16 regions, 30 samples of a \
             reach, 9 normalised Gaussians. 12, 24, 47, 100 and 400 demonstrations are of 2, 3, 6, 13 and 50 people; {MANY} in the first world only.\n\n{table}",
            people(seed)
        ),
        figure: Some(Figure::panels("contact_learned.svg", title, 3, panels)),
        summary: Vec::new(),
    })
}

/// A fused predictor that may be kept from the gaze, and what it said of the surfaces.
struct Listener {
    predictor: FusedPredictor<LearnedEstimator>,
    gaze: bool,
    /// Time, s, surface and its probability.
    said: Vec<(f64, SurfaceId, f64)>,
}

impl Predictor for Listener {
    fn predict(&mut self, scene: &Scene, seen: &Seen<'_>) -> &[ContactPrediction] {
        let seen = Seen {
            gaze: seen.gaze.filter(|_| self.gaze),
            ..*seen
        };
        let answers = self.predictor.predict(scene, &seen);
        let one = |a: &ContactPrediction| (seen.frame.t_s, a.surface, a.probability);
        self.said.extend(answers.iter().map(one));
        answers
    }
}

/// What was said of all touches, and how surprising the touched surfaces were.
struct Heard {
    told: Vec<Told>,
    /// Mean of `-ln p` over the shares.
    log_score: f64,
    /// Mean number of answers.
    answers: f64,
}

fn hear(
    predictor: &FusedPredictor<LearnedEstimator>,
    gaze: bool,
    room: &Room,
    people: &[Stream],
    condition: &Condition,
) -> anyhow::Result<Heard> {
    let mut all = Vec::new();
    let (mut scores, mut answers) = (Vec::new(), 0);
    for person in people {
        let mut listener = Listener {
            predictor: predictor.clone(),
            gaze,
            said: Vec::with_capacity(1 << 16),
        };
        let person = std::slice::from_ref(person);
        let told = contact_rooms::listen(&mut listener, room, person, condition)?;
        let said = &listener.said;
        for touch in told.iter().map(|t| &t.touch) {
            for share in SHARES {
                let t_s = touch.start_s + share * (touch.contact_s - touch.start_s);
                let until = said.partition_point(|s| s.0 <= t_s);
                let last = said[..until].last().map_or(t_s, |s| s.0);
                let now = said[..until].iter().rev().take_while(|s| s.0 == last);
                answers += now.clone().count();
                let right = now.filter(|s| s.1 == touch.surface).map(|s| s.2);
                scores.push(-right.fold(0.0, f64::max).max(LEAST).ln());
            }
        }
        all.extend(told);
    }
    let count = scores.len().max(1) as f64;
    Ok(Heard {
        told: all,
        // Not "-0.000" where nothing else was possible.
        log_score: scores.iter().sum::<f64>() / count + 0.0,
        answers: answers as f64 / count,
    })
}

/// Fusion with gaze and surfaces: by the number of rays of a hypothesis, and of hypotheses.
///
/// # Errors
/// None in practice: rooms and people are made here.
pub fn fusion(seed: u64) -> anyhow::Result<Section> {
    let condition = Condition::usual();
    let cast = contact_rooms::Cast {
        people: [12, 16],
        seed,
        ..contact_rooms::Cast::default()
    };
    let mut table = MarkdownTable::new([
        "touchable surfaces",
        "hypotheses, at most",
        "rays of each",
        "median",
        "p99",
        "right surface at 50 / 70 / 90 %, %",
        "log score",
        AT,
        "answers",
    ]);
    let mut quoted = Vec::new();
    let (mut points, mut surprises) = (Vec::new(), Vec::new());
    for count in [1, 6, 12] {
        let room = Room::new(count)?;
        let [train, test] = contact_rooms::streams(&room, &condition, &cast)?;
        let reaches = contact_rooms::reaches(&train, &condition)?;
        let estimator = LearnedModel::train(
            &reaches,
            &LearnedConfig {
                combination: Combination::Both,
                ..LearnedConfig::default()
            },
        )?
        .estimator();
        let gaze = GazeModel::default().fit(&reaches)?;
        let mut line = [Vec::new(), Vec::new()];
        let hypotheses = [(1, 19), (2, 19)].into_iter();
        let rays = [3, 7, 19, 37, 75].map(|rays| (3, rays));
        for (hypotheses, rays) in hypotheses.chain(rays) {
            let mut config = FusedConfig {
                gaze,
                rays,
                ..FusedConfig::default()
            };
            if hypotheses == 2 {
                // The fixation before is forgotten at once.
                config.gaze.memory_s = 1e-6;
            }
            let sees = hypotheses > 1;
            let predictor = FusedPredictor::new(estimator.clone(), config)?;
            let heard = hear(&predictor, sees, &room, &test, &condition)?;
            let times = heard.told.iter().flat_map(|t| &t.heard);
            let timing = Timing::from_samples_ns(times.map(|h| 1e3 * h.took_us).collect());
            let at = SHARES.map(|share| rooms_scores::summary(&heard.told, Moment::Share(share)));
            table.row([
                count.to_string(),
                hypotheses.to_string(),
                rays.to_string(),
                format_ns(timing.median_ns),
                format_ns(timing.p99_ns),
                at.map(|s| format!("{:.1}", 100.0 * s.right)).join(" / "),
                format!("{:.3}", heard.log_score),
                at.map(|s| format!("{:.1}", 1e3 * s.median_m)).join(" / "),
                format!("{:.1}", heard.answers),
            ]);
            if hypotheses == 3 {
                let point = |y: f64| Point {
                    at: (timing.median_ns, y),
                    label: rays.to_string(),
                    ..Point::default()
                };
                line[0].push(point(1e3 * at[1].median_m));
                line[1].push(point(heard.log_score));
            }
            if hypotheses == 3 && rays == FusedConfig::default().rays && count == 6 {
                quoted = vec![summary(
                    "contact",
                    "ranked surfaces and points, 6 surfaces",
                    &timing,
                    format!(
                        "{:.0} mm (median), {:.0} % the right surface at 70 % of a reach",
                        1e3 * at[1].median_m,
                        100.0 * at[1].right
                    ),
                )];
            }
        }
        let name = match count {
            1 => "1 surface".to_owned(),
            _ => format!("{count} surfaces"),
        };
        let [point, surprise] = line;
        points.push(Line {
            name: name.clone(),
            points: point,
        });
        // A single surface is no surprise.
        if count > 1 {
            surprises.push(Line {
                name,
                points: surprise,
            });
        }
    }
    let title =
        "Fused prediction: error by the time of a prediction; numbers are rays of a hypothesis";
    let time = Axis::Time("median time of a prediction");
    Ok(Section {
        text: format!(
            "### Fusion with gaze and surfaces\n\nSimulated people touch rooms of 1, 6 and 12 touchable surfaces: 12 people to \
             learn from, 16 others to be judged by, {} touches of each, seed {seed}. Times are of a prediction, the \
             estimator included. Log score: mean of -ln p of the touched surface at 50, 70 and 90 % of the time, p at \
             least {LEAST}; 0 is perfect. One hypothesis: no gaze; two: the present line of sight too; three: also the fixation before.\n\n{table}",
            cast.touches
        ),
        figure: Some(Figure::panels(
            "contact_fusion.svg",
            title,
            2,
            vec![
                Panel {
                    title: "point, at 70 % of the time".to_owned(),
                    axes: [time, Axis::Number("median error, mm")],
                    lines: points,
                },
                Panel {
                    title: "surface, at 50, 70 and 90 % of the time".to_owned(),
                    axes: [time, Axis::Number("log score")],
                    lines: surprises,
                },
            ],
        )),
        summary: quoted,
    })
}
