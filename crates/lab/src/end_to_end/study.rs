//! The runs of the study.

use hwall::response::{
    ResponseConfig, ResponseDemonstration, ResponseEstimator, ResponseModel, Task,
};
use hwall_contact::{ContactEstimate, ContactEstimator, LearnedConfig, LearnedModel};
use hwall_hand::LabelledReach;
use hwall_haptics::{Board, PlaceTolerance};
use hwall_sim::{Gesture, PersonConfig};
use hwall_stage::built_in_room::BuiltInRoom;
use hwall_stage::numbers::count_within;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::participants;
use hwall_stage::person::predictors::{
    PredictionRecord, PredictorKind, Predictors, TrainingPeople,
};
use hwall_stage::person::responses::{self, Answered, PEOPLE, Scenery, TOUCHES, answered};
use hwall_stage::run::people::{self, JudgedTouch};
use hwall_stage::run::stage::Stage;
use hwall_testkit::quantiles;
use std::sync::Arc;

/// Settings of the study.
#[derive(Debug, Clone, clap::Args)]
pub struct Request {
    /// Touches of each kind of people, a dozen for each person
    #[arg(long, default_value_t = 240, value_parser = count_within::<1, 100_000>, allow_negative_numbers = true)]
    pub touches: usize,
    /// Seed of the people who touch and of the sensors' noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
}

/// Kinds of people who touch.
const KINDS: [PersonKind; 2] = [PersonKind::Plain, PersonKind::Varied];
/// Held-out people, and reaches of each.
const HELD_OUT: u64 = 10;
const REACHES: usize = 12;

/// Discrimination of tasks after a share of the time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToldApart {
    /// The task.
    pub task: Task,
    /// Reaches of held-out people.
    pub reaches: usize,
    /// Number of reaches with a probability of the task above 0.5 after 30, 50, 70 and 100 % of the time.
    pub right: [usize; 4],
    /// Distance of the presented middle at the end, in rising order, m.
    pub off_m: [f64; 2],
}

/// Shares of the time at which discrimination is evaluated.
pub(super) const TOLD_AT: [f64; 4] = [0.3, 0.5, 0.7, 1.0];

/// The whole study.
pub struct Results {
    /// Number of training demonstrations, and of reaches of held-out people.
    pub demonstrations: usize,
    /// See `demonstrations`.
    pub held_out: usize,
    /// Components of the mixture.
    pub components: usize,
    pub(super) ends: Vec<EndErrors>,
    /// One for each task.
    pub told_apart: Vec<ToldApart>,
    /// One for each kind and leader.
    pub led: Vec<Led>,
}

/// Runs the study in the built-in room with an iiwa 7 and a plain board; `progress` receives the chapter and its share done.
///
/// # Errors
/// As for the main job.
pub fn run(request: &Request, mut progress: impl FnMut(&str, f64)) -> anyhow::Result<Results> {
    let room = BuiltInRoom::new()?;
    let people = TrainingPeople::default();
    let plain = room.people(PersonKind::Plain, 1, request.seed)?;
    let walls = room.walls(&plain, false)?;
    let scenery = room.scenery(&walls, &people, false);
    progress("demonstrations", 0.0);
    let learnt = answered(&scenery, Task::Touch, 0..PEOPLE, TOUCHES)?;
    let held_out = answered(&scenery, Task::Touch, PEOPLE..PEOPLE + HELD_OUT, REACHES)?;
    let told = |share| progress("ends", share);
    let (ends, components) = ends(&scenery, &learnt, &held_out, told)?;
    let told_apart = told_apart(&scenery, |share| progress("tasks", share))?;
    let (touches, seed) = (request.touches, request.seed);
    let told = |share| progress("touches", share);
    let led = led(&scenery, touches, seed, told)?;
    Ok(Results {
        demonstrations: learnt.len(),
        held_out: held_out.len(),
        components,
        ends,
        told_apart,
        led,
    })
}

fn shown(answered: &[Answered]) -> Vec<ResponseDemonstration> {
    answered.iter().map(|one| one.shown.clone()).collect()
}

/// Errors of every method, and the number of components of the mixture.
fn ends(
    scenery: &Scenery<'_>,
    learnt: &[Answered],
    held_out: &[Answered],
    mut progress: impl FnMut(f64),
) -> anyhow::Result<(Vec<EndErrors>, usize)> {
    let arm = scenery.arm.kinematics();
    let shown = shown(learnt);
    let mixture = ResponseModel::train(&shown, &ResponseConfig::default())?;
    progress(0.2);
    let mut estimator = ResponseEstimator::new(&mixture, Arc::clone(arm));
    let name = "end-to-end, mixture";
    let mut all = vec![EndErrors::follow(name, &mut estimator, held_out, true)];
    progress(0.5);
    let reaches: Vec<LabelledReach> = learnt.iter().map(|one| one.reach.clone()).collect();
    let learned = LearnedModel::train(&reaches, &LearnedConfig::default())?;
    let mut estimator: Box<dyn ContactEstimator> = Box::new(learned.estimator());
    let name = "learned point, exact inverse kinematics";
    all.push(EndErrors::follow(name, &mut estimator, held_out, false));
    progress(1.0);
    Ok((all, mixture.tasks().len()))
}

/// Touches of pointing hands on all surfaces, pushes of flat ones at the door, grasps at the front of the shelf.
const TASKS: [(Task, Gesture, Option<&str>); 3] = [
    (Task::Touch, Gesture::Pointing, None),
    (Task::Push, Gesture::Flat, Some("door")),
    (Task::Grasp, Gesture::Grasping, Some("shelf_front")),
];

fn told_apart(
    scenery: &Scenery<'_>,
    mut progress: impl FnMut(f64),
) -> anyhow::Result<Vec<ToldApart>> {
    let (mut learnt, mut judged) = (Vec::new(), Vec::new());
    for (number, (task, gesture, surface)) in TASKS.into_iter().enumerate() {
        let people = TrainingPeople {
            person: PersonConfig {
                gesture: Some(gesture),
                ..scenery.people.person
            },
            ..scenery.people.clone()
        };
        let scenery = Scenery {
            people: &people,
            ..*scenery
        };
        let is_there = |one: &Answered| {
            surface.is_none_or(|name| scenery.scene.surface(one.surface).name == name)
        };
        let held_out = PEOPLE..PEOPLE + HELD_OUT;
        for (people, all) in [(0..PEOPLE, &mut learnt), (held_out, &mut judged)] {
            let made = answered(&scenery, task, people, TOUCHES)?;
            all.extend(made.into_iter().filter(is_there));
        }
        progress((number + 1) as f64 / 4.0);
    }
    let model = ResponseModel::train(&shown(&learnt), &ResponseConfig::default())?;
    let arm = scenery.arm.kinematics();
    let mut estimator = ResponseEstimator::new(&model, Arc::clone(arm));
    let mut of_task = |task: Task| {
        let reaches: Vec<&Answered> = judged.iter().filter(|a| a.shown.task == task).collect();
        let (mut right, mut off_m) = ([0; 4], Vec::new());
        for one in &reaches {
            estimator.begin();
            let Some(first) = one.reach.frames.first() else {
                continue;
            };
            let lasts_s = one.reach.contact_s - first.t_s;
            // The share of each frame, and whether the task is known by then.
            let (mut known, mut end_m) = (vec![(f64::NEG_INFINITY, false)], f64::NAN);
            for frame in &one.reach.frames {
                let mut is_known = known[known.len() - 1].1;
                if let Some(estimate) = estimator.step(frame) {
                    end_m = estimate.point_m.distance(one.target.point_m);
                    let posterior = estimator.posterior();
                    is_known = posterior.is_some_and(|of| of.tasks[task as usize] > 0.5);
                }
                known.push(((frame.t_s - first.t_s) / lasts_s, is_known));
            }
            for (at, right) in TOLD_AT.iter().zip(&mut right) {
                let by = known.partition_point(|(share, _)| share <= at);
                *right += usize::from(known[by - 1].1);
            }
            off_m.push(end_m);
        }
        ToldApart {
            task,
            reaches: reaches.len(),
            right,
            off_m: quantiles(off_m, [0.5, 0.9]),
        }
    };
    let told = TASKS.map(|(task, ..)| of_task(task)).to_vec();
    progress(1.0);
    Ok(told)
}

/// Shares of the time of a reach at which it is evaluated.
pub(super) const SHARES: [f64; 6] = [0.3, 0.5, 0.7, 0.8, 0.9, 1.0];

/// Error of the presented face against the demonstrated one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EndError {
    /// Distance of the middles, m.
    pub(super) middle_m: f64,
    /// Part of it along the normal, m.
    pub(super) gap_m: f64,
    /// Angle between the normals, rad; `None` from an estimator of points.
    pub(super) tilt_rad: Option<f64>,
    /// Is the demonstrated middle in the 90 % region? `None` without a covariance.
    pub(super) is_in_region: Option<bool>,
}

/// Squared Mahalanobis distance of the 90 % region in space.
const REGION_90: f64 = 6.251;

impl EndError {
    /// `turned`: is the estimate's normal part of the result?
    fn new(estimate: &ContactEstimate, turned: bool, answered: &Answered) -> Self {
        let wanted_m = answered.target.point_m;
        let off = estimate.point_m - wanted_m;
        let truth = answered.target.normal.normalize_or_zero();
        let normal = estimate.normal.filter(|_| turned);
        let away = estimate.distance_squared(wanted_m);
        Self {
            middle_m: off.length(),
            gap_m: off.dot(truth).abs(),
            tilt_rad: normal.map(|normal| normal.angle_between(truth)),
            is_in_region: away.map(|away| away <= REGION_90),
        }
    }
}

/// The errors of an estimator at each of the [`SHARES`].
pub(super) struct EndErrors {
    /// For tables.
    pub(super) name: String,
    /// At each share, the errors of all reaches with an estimate by then.
    pub(super) at: [Vec<EndError>; SHARES.len()],
}

impl EndErrors {
    /// Follows every reach. `turned`: is the estimate's normal part of the result?
    pub(super) fn follow<E: ContactEstimator>(
        name: impl Into<String>,
        estimator: &mut E,
        answered: &[Answered],
        turned: bool,
    ) -> Self {
        let mut at: [Vec<EndError>; SHARES.len()] = Default::default();
        for answered in answered {
            estimator.begin();
            let frames = &answered.reach.frames;
            let Some(first) = frames.first() else {
                continue;
            };
            let lasts_s = answered.reach.contact_s - first.t_s;
            let estimates = frames
                .iter()
                .map(|frame| (frame.t_s - first.t_s, estimator.step(frame)));
            let estimates: Vec<(f64, Option<ContactEstimate>)> = estimates.collect();
            for (share, errors) in SHARES.into_iter().zip(&mut at) {
                let by = estimates.partition_point(|(t_s, _)| *t_s <= share * lasts_s);
                let newest = by.checked_sub(1).and_then(|i| estimates[i].1);
                errors.extend(newest.map(|estimate| EndError::new(&estimate, turned, answered)));
            }
        }
        let name = name.into();
        Self { name, at }
    }
}

/// Control period, s.
const PERIOD_S: f64 = 1e-3;

/// Touches of one kind of people, with one leader.
#[derive(Debug, Clone)]
pub struct Led {
    /// Who touched.
    pub kind: PersonKind,
    /// Who led the board.
    pub leader: PredictorKind,
    /// The touches within the arm's reach.
    pub touches: Vec<JudgedTouch>,
    /// Computing time of the leader in frames with a new inference, us.
    pub predicted_us: Vec<f64>,
    /// Their share of all frames.
    pub inferring: f64,
}

impl Led {
    /// Number of touches with the face in place before the hand, within 5 mm and 2 degrees.
    pub(super) fn in_place(&self) -> usize {
        self.count(|touch| touch.outcome.in_place())
    }

    /// Number of touches with the face under the touched point within `gap_m`, m, at the hand's arrival.
    pub(super) fn within(&self, gap_m: f64) -> usize {
        let half_m = Board::default().half_width_m - PlaceTolerance::default().inset_m;
        self.count(|touch| touch.outcome.gap_m <= gap_m && touch.outcome.offset_m <= half_m)
    }

    /// Number of felt touches.
    pub(super) fn felt(&self) -> usize {
        self.count(|touch| touch.outcome.felt_after_s.is_some())
    }

    fn count(&self, what: impl Fn(&JudgedTouch) -> bool) -> usize {
        self.touches.iter().filter(|touch| what(touch)).count()
    }
}

/// Runs touches of each kind for both leaders; `progress` receives the share done, 0 to 1.
fn led(
    scenery: &Scenery<'_>,
    touches: usize,
    seed: u64,
    mut progress: impl FnMut(f64),
) -> anyhow::Result<Vec<Led>> {
    let Scenery { scene, arm, .. } = *scenery;
    let mut all = Vec::new();
    let runs = 2.0 * KINDS.len() as f64;
    for leader in [PredictorKind::Fused, PredictorKind::EndToEnd] {
        let trained = Predictors::train(scene, arm, scenery.people, Some(leader))?;
        let (predictors, _) = responses::taught(trained.0, scenery)?;
        let stage = Stage::of(scenery, &predictors, PERIOD_S);
        for kind in KINDS {
            let done = all.len() as f64;
            let cast = participants::simulated(scene, arm, kind, touches, seed)?;
            let made = people::run(&stage, &cast, |share| progress((done + share) / runs))?;
            let predicted_us: Vec<f64> = made
                .iter()
                .flat_map(|run| inferring_us(&run.run.predictions, leader))
                .collect();
            let frames: usize = made.iter().map(|run| run.run.predictions.len()).sum();
            let inferring = predicted_us.len() as f64 / frames.max(1) as f64;
            let touches = made.into_iter().flat_map(|run| run.touches);
            let within_reach = |touch: &JudgedTouch| touch.outcome.unreachable.is_none();
            all.push(Led {
                kind,
                leader,
                touches: touches.filter(within_reach).collect(),
                predicted_us,
                inferring,
            });
        }
    }
    Ok(all)
}

/// Time of predictions that differ from the previous one, us: for a hand at rest, as in most frames, a predictor of motions needs
/// almost no time.
fn inferring_us(
    records: &[PredictionRecord],
    leader: PredictorKind,
) -> impl Iterator<Item = f64> + '_ {
    let leader = leader as usize;
    records.windows(2).filter_map(move |pair| {
        let [before, now] = pair else { return None };
        let point_m = |of: &PredictionRecord| of.likeliest[leader].map(|place| place.point_m);
        let is_new = point_m(now).is_some() && point_m(now) != point_m(before);
        is_new.then(|| 1e-3 * now.took_ns[leader])
    })
}
