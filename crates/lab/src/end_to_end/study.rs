//! The runs of the study.

use super::ends::EndErrors;
use super::touches;
pub use super::touches::Led;
use hwall::response::{
    ResponseConfig, ResponseDemonstration, ResponseEstimator, ResponseModel, Task,
};
use hwall_contact::{ContactEstimator, LearnedConfig, LearnedModel};
use hwall_hand::LabelledReach;
use hwall_sim::{Gesture, PersonConfig};
use hwall_stage::built_in_room::BuiltInRoom;
use hwall_stage::numbers::count_within;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::predictors::TrainingPeople;
use hwall_stage::person::responses::{Answered, PEOPLE, Scenery, TOUCHES, answered};
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
    let led = touches::run(&scenery, &KINDS, touches, seed, told)?;
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
            let mut due = TOLD_AT.iter().zip(&mut right).peekable();
            let (mut known, mut end_m) = (false, f64::NAN);
            for frame in &one.reach.frames {
                let share = (frame.t_s - first.t_s) / lasts_s;
                while let Some((_, right)) = due.next_if(|(at, _)| **at < share) {
                    *right += usize::from(known);
                }
                if let Some(estimate) = estimator.step(frame) {
                    end_m = estimate.point_m.distance(one.target.point_m);
                    let posterior = estimator.posterior();
                    known = posterior.is_some_and(|of| of.tasks[task as usize] > 0.5);
                }
            }
            for (_, right) in due {
                *right += usize::from(known);
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
