//! Recorded people in front of the simulated arm: each reach of a recording runs in a separate session.

use crate::contact::panels::{
    Learnt, MOST_OFF_M, PANEL_NAME, Trial, objects_of, people_of, rooms_of, scene_of,
};
use anyhow::{Context, bail};
use glam::DVec3;
use hwall::LikelyTouches;
use hwall::haptics::Board;
use hwall_contact::{
    ContactPrediction, FusedPredictor, LearnedConfig, LearnedEstimator, Predictor, PredictorInput,
};
use hwall_geometry::Pose;
use hwall_hand::{HandError, HandFilterConfig, HandFrame};
use hwall_scene::Scene;
use hwall_stage::arms::BoardArm;
use hwall_stage::input::floor_pose::FloorPose;
use hwall_stage::input::place::base_behind;
use hwall_stage::person::hand::Hand;
use hwall_stage::person::participants::Participant;
use hwall_stage::person::predictors::{PredictorKind, Predictors, TrainingPeople};
use hwall_stage::person::responses::Scenery;
use hwall_stage::person::touches::Touch;
use hwall_stage::report::summary::Summary;
use hwall_stage::run::evaluation::regret::Miss;
use hwall_stage::run::logs::view_log::ViewLog;
use hwall_stage::run::people::{self, PersonRun};
use hwall_stage::run::stage::Stage;
use hwall_stage::training::{ON_TARGET_RAD, first_rest_s};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Control period, s.
const PERIOD_S: f64 = 1e-3;

/// Settings of the study.
#[derive(Debug, Clone)]
pub struct Request<'a> {
    /// The reaches, of at least two people in each room.
    pub trials: &'a [Trial],
    /// The estimator; it sees the gaze if any is recorded.
    pub learned: LearnedConfig,
    /// Seed of the arm's sensors.
    pub seed: u64,
    /// Only this reach, `person/trial`, with the decisions of the policy on standard error.
    pub explain: Option<&'a str>,
}

/// Results for one person, or for all.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The person.
    pub person: String,
    /// Summary of the reaches.
    pub summary: Summary,
}

/// The whole study.
#[derive(Debug, Clone, PartialEq)]
pub struct Results {
    /// One for each person, and one for all.
    pub rows: Vec<Row>,
    /// Reaches without the board in place, `person/trial (object)` and what stopped the arm, and the reason.
    pub missed: Vec<(String, Miss)>,
}

/// Runs every reach; `progress` receives the person after each.
///
/// A reach has the scene of [`panels`](crate::contact::panels), but with an upright panel, because the arm presents walls. All
/// reaches for an object have the same base pose. The predictor is trained on all other people of the room, in the frame of the room.
/// Nothing is learnt from one reach for the next.
///
/// # Errors
/// A room with fewer than two people; a head that is never seen, or is exactly above the touch; too little training data; no such reach to
/// explain.
pub fn run(request: &Request<'_>, progress: impl Fn(&str) + Sync) -> anyhow::Result<Results> {
    let rooms = rooms_of(request.trials)?;
    let arm = BoardArm::named("iiwa7", &Board::default())?;
    let people = TrainingPeople::default();
    let mut tasks = Vec::new();
    for trials in rooms.values() {
        let room = Room {
            trials,
            objects: objects_of(trials),
            bases: bases(trials)?,
            arm: &arm,
            people: &people,
        };
        tasks.extend(
            people_of(trials)
                .into_iter()
                .map(|person| (room.clone(), person)),
        );
    }
    let ran = tasks.par_iter().map(|(room, person)| {
        let runs = room.runs_of(person, request, &progress);
        runs.with_context(|| format!("{}, without {person}", room.trials[0].room))
    });
    let ran = ran.collect::<anyhow::Result<Vec<_>>>()?;
    let (mut rows, mut missed, mut all) = (Vec::new(), Vec::new(), Vec::new());
    for ((_, person), reaches) in tasks.iter().zip(ran) {
        let (trials, runs): (Vec<&Trial>, Vec<PersonRun>) = reaches.into_iter().unzip();
        for (trial, run) in trials.iter().zip(&runs) {
            let name = format!("{} ({})", trial.reach.name(), trial.object);
            missed.extend(run.touches.iter().filter_map(|touch| {
                let stopped = touch.regret.stopped_by;
                let stopped = stopped.map_or_else(String::new, |by| format!(", stopped: {by}"));
                Some((format!("{name}{stopped}"), touch.regret.miss?))
            }));
        }
        rows.extend((!runs.is_empty()).then(|| row_of(person, &runs)));
        all.extend(runs);
    }
    if let (true, Some(name)) = (all.is_empty(), request.explain) {
        bail!("no reach {name:?} in the recording: PERSON/TRIAL, as in its columns");
    }
    rows.push(row_of("all", &all));
    Ok(Results { rows, missed })
}

fn row_of(person: &str, runs: &[PersonRun]) -> Row {
    Row {
        person: person.to_owned(),
        summary: Summary::new(runs),
    }
}

/// The arm's base for each object of a room: behind the mean end of its reaches, facing the mean first position of the heads. Upright
/// panels are well within reach there.
fn bases<'a>(trials: &[&'a Trial]) -> Result<BTreeMap<&'a str, FloorPose>, HandError> {
    let mut of = BTreeMap::<&str, Vec<(DVec3, DVec3)>>::new();
    for trial in trials {
        let ends = of.entry(&trial.object).or_default();
        ends.push((trial.reach.contact_m, facing(trial)?));
    }
    let base = |ends: Vec<(DVec3, DVec3)>| {
        let sum = |of: fn(&(DVec3, DVec3)) -> DVec3| ends.iter().map(of).sum::<DVec3>();
        let normal = sum(|end| end.1).try_normalize().unwrap_or(DVec3::X);
        base_behind(sum(|end| end.0) / ends.len() as f64, normal)
    };
    Ok(of
        .into_iter()
        .map(|(object, ends)| (object, base(ends)))
        .collect())
}

/// The horizontal unit normal of the panel of a reach, towards the head.
fn facing(trial: &Trial) -> Result<DVec3, HandError> {
    let towards_m = trial.towards_head_m()?;
    let normal = DVec3::new(towards_m.x, towards_m.y, 0.0).try_normalize();
    normal.ok_or_else(|| HandError::Reach {
        reach: trial.reach.name(),
        what: "the head is right above the touch: no upright panel faces it",
    })
}

/// A room, and the arm in it.
#[derive(Clone)]
struct Room<'a> {
    trials: &'a [&'a Trial],
    objects: BTreeMap<&'a str, [DVec3; 2]>,
    bases: BTreeMap<&'a str, FloorPose>,
    arm: &'a BoardArm,
    people: &'a TrainingPeople,
}

impl<'a> Room<'a> {
    /// Trains on all but one person, and runs the reaches of that person.
    fn runs_of(
        &self,
        person: &str,
        request: &Request<'_>,
        progress: &(impl Fn(&str) + Sync),
    ) -> anyhow::Result<Vec<(&'a Trial, PersonRun)>> {
        let (mut own, others): (Vec<&Trial>, Vec<&Trial>) =
            self.trials.iter().partition(|trial| trial.person == person);
        own.retain(|trial| {
            request
                .explain
                .is_none_or(|name| trial.reach.name() == name)
        });
        if own.is_empty() {
            return Ok(Vec::new());
        }
        let mut frames = others.iter().flat_map(|trial| &trial.frames);
        let gaze = frames.any(|frame| frame.gaze_ray().is_some());
        let learnt = Learnt::of(
            &others,
            &LearnedConfig {
                gaze,
                ..request.learned
            },
        )?;
        let predictor = learnt.fused()?;
        let run = |trial: &&'a Trial| {
            let run = self.run_of(trial, &predictor, request);
            progress(person);
            Ok((*trial, run.with_context(|| trial.reach.name())?))
        };
        own.iter().map(run).collect()
    }

    /// Runs one reach.
    fn run_of(
        &self,
        trial: &Trial,
        predictor: &FusedPredictor<LearnedEstimator>,
        request: &Request<'_>,
    ) -> anyhow::Result<PersonRun> {
        let normal = facing(trial)?;
        let across = [DVec3::Z.cross(normal), DVec3::Z];
        let mut objects = self.objects.clone();
        objects.retain(|_, of| !holds(of, trial.reach.contact_m));
        let in_room = scene_of(trial, &objects, across, MOST_OFF_M)?;
        let base_from_room = self.bases[&*trial.object].outer_from_here().inverse();
        let base_from_room = Pose::from_affine(&base_from_room)?;
        let scene = in_room.placed(&base_from_room);
        let frames = trial.frames.iter();
        let participant = Participant {
            // The recorded pointer never changes its shape; this does not mean a frozen tracker.
            hand: Hand::Recorded(
                frames
                    .map(|frame| frame.transformed(&base_from_room))
                    .collect(),
                HandFilterConfig::simulated(),
            ),
            touches: vec![touch_of(trial, normal, &base_from_room)],
            seed: request.seed,
        };
        let walls = self.arm.walls_of(&scene, LikelyTouches::default(), false)?;
        let scenery = Scenery::of(&scene, self.arm, &walls, self.people).textured(false);
        let predictor = InRoom::new(predictor.clone(), in_room, base_from_room);
        let predictors = Predictors::of(Some(predictor), PredictorKind::Fused)?;
        let stage = Stage {
            explain: request.explain.map(|_| None),
            ..Stage::of(&scenery, &predictors, PERIOD_S)
        };
        let mut runs = people::run(&stage, &[participant], |_| {})?;
        let mut run = runs.pop().context("nobody ran")?;
        // Free the view, which takes megabytes for each reach.
        run.run.view = ViewLog::default();
        Ok(run)
    }
}

/// Is a point in a box? Most of a box is air. If a person pointed into the box of another object, that box is left out of the scene.
fn holds([centre_m, size_m]: &[DVec3; 2], point_m: DVec3) -> bool {
    (point_m - centre_m).abs().cmple(0.5 * size_m).all()
}

/// The touch of a reach, seen from the base.
fn touch_of(trial: &Trial, normal: DVec3, base_from_room: &Pose) -> Touch {
    let (point_m, contact_s) = (trial.reach.contact_m, trial.reach.contact_s);
    let is_on_target = |frame: &HandFrame| {
        let on_target = |ray: hwall_hand::GazeRay| {
            ray.direction.angle_between(point_m - ray.origin_m) < ON_TARGET_RAD
        };
        frame.gaze_ray().is_some_and(on_target)
    };
    let before = trial.frames.iter().filter(|frame| frame.t_s <= contact_s);
    Touch {
        surface: PANEL_NAME.to_owned(),
        point_m: base_from_room.transform_point(point_m),
        normal: base_from_room.transform_vector(normal),
        start_s: 0.0,
        contact_s,
        end_s: contact_s,
        landed_s: first_rest_s(before.map(|frame| (frame.t_s, is_on_target(frame)))),
    }
}

/// Transforms the session's input from the frame of the base to that of the room, because the behaviour of a person does not depend on
/// where the arm is installed.
#[derive(Debug, Clone)]
struct InRoom<P> {
    predictor: P,
    scene: Scene,
    room_from_base: Pose,
    base_from_room: Pose,
    answers: Vec<ContactPrediction>,
}

impl<P: Predictor> InRoom<P> {
    /// `scene`: in the frame of the room, with the same surfaces as the session's scene; no surface may move.
    fn new(predictor: P, scene: Scene, base_from_room: Pose) -> Self {
        Self {
            predictor,
            scene,
            room_from_base: base_from_room.inverse(),
            base_from_room,
            answers: Vec::new(),
        }
    }
}

impl<P: Predictor> Predictor for InRoom<P> {
    fn predict(&mut self, _: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        let pose = &self.room_from_base;
        let frame = input.frame.transformed(pose);
        let hand = input.hand.map(|hand| hand.transformed(pose));
        let input = PredictorInput {
            frame: &frame,
            hand: hand.as_ref(),
            gaze: input.gaze.transformed(pose),
        };
        let there = self.predictor.predict(&self.scene, &input).iter();
        self.answers.clear();
        let here = there.map(|contact| contact.transformed(&self.base_from_room));
        self.answers.extend(here);
        &self.answers
    }

    fn is_unfamiliar(&self) -> bool {
        self.predictor.is_unfamiliar()
    }

    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        let there_m = self.room_from_base.transform_point(contact_m);
        self.predictor.touched(there_m, contact_s);
    }

    fn reset(&mut self) {
        self.predictor.reset();
    }
}
