//! Demonstrations of hand and joints: simulated people reach in the scene, and the arm presents what they touch.

use crate::input::arms::BoardArm;
use crate::person::predictors::{PredictorKind, Predictors, TrainingPeople, streams_of};
use crate::person::training;
use anyhow::{Context, ensure};
use hwall::Walls;
use hwall::haptics::{Board, BoardTarget, surface_axes};
use hwall::response::{
    Demonstrator, EndToEnd, ResponseConfig, ResponseDemonstration, ResponseModel, Task,
};
use hwall::texture::TextureLevels;
use hwall_hand::LabelledReach;
use hwall_scene::{Scene, SurfaceId, SurfaceKind};
use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

/// People who demonstrate to the main job, and touches of each: more than the other predictors learn from, because each part of
/// the joints' range needs its own.
pub const PEOPLE: u64 = 24;
/// See [`PEOPLE`].
pub const TOUCHES: usize = 24;
/// Fewer demonstrations teach nothing.
const LEAST: usize = 24;
/// A place is on a surface within this, m.
const ON_IT_M: f64 = 0.05;
/// How far the edge of a board is inside a grip, m.
const GRIP_M: f64 = 0.02;

/// Where the arm answers, and whom.
#[derive(Clone, Copy)]
pub struct Scenery<'a> {
    /// What is touched, in the arm's base frame.
    pub scene: &'a Scene,
    /// The arm, with the face of the board as its tool.
    pub arm: &'a BoardArm,
    /// The board.
    pub board: &'a Board,
    /// Where the arm waits, and from which configurations it presents.
    pub walls: &'a Walls,
    /// Who demonstrates.
    pub people: &'a TrainingPeople,
    /// Does the board present the roughness of surfaces, which takes a roll of its own?
    pub textured: bool,
}

/// What the response of the main job is taught of a task.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taught {
    /// It is shown so many times.
    Shown(usize),
    /// It is not shown.
    Untaught(Untaught),
}

/// Why a task is not shown in the main job. The example `end_to_end` shows all three and judges how they are told apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Untaught {
    /// Nothing in the scene gives way to a push.
    NothingGivesWay,
    /// What gives way is presented as for a touch, with the middle of the board under the fingertip: to tell a push from a touch would
    /// lead the arm nowhere else.
    PushedAsTouched,
    /// A scene says of surfaces where they are and how they move, not around which edge a hand can close, and the people of the main job
    /// touch with the fingertip.
    NothingToGrasp,
}

impl fmt::Display for Untaught {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NothingGivesWay => "nothing in the scene gives way",
            Self::PushedAsTouched => "what gives way is presented as for a touch",
            Self::NothingToGrasp => "a scene does not say what can be grasped",
        })
    }
}

/// What is taught of every task in a scene with so many demonstrations, in the order of [`Task::ALL`].
#[must_use]
pub fn taught_tasks(scene: &Scene, demonstrations: usize) -> [Taught; 3] {
    let still = [SurfaceKind::Static, SurfaceKind::Untouchable];
    let gives_way = scene.surfaces().iter().any(|s| !still.contains(&s.kind));
    Task::ALL.map(|task| match task {
        Task::Touch => Taught::Shown(demonstrations),
        Task::Push if gives_way => Taught::Untaught(Untaught::PushedAsTouched),
        Task::Push => Taught::Untaught(Untaught::NothingGivesWay),
        Task::Grasp => Taught::Untaught(Untaught::NothingToGrasp),
    })
}

/// The tasks that are not taught, each with its reason; empty if all are.
#[must_use]
pub fn untaught_line(taught: &[Taught; 3]) -> String {
    let each = Task::ALL.iter().zip(taught);
    let untaught = each.filter_map(|(task, taught)| match taught {
        Taught::Shown(_) => None,
        Taught::Untaught(why) => Some(format!("no {}: {why}", task.name())),
    });
    untaught.collect::<Vec<_>>().join("; ")
}

/// The predictors, with the end-to-end response trained if it leads, and then a line for the user: what was learnt from whom.
///
/// # Errors
/// As [`end_to_end`].
pub fn taught(
    predictors: Predictors,
    scenery: &Scenery<'_>,
) -> anyhow::Result<(Predictors, Option<String>)> {
    if predictors.leader() != PredictorKind::EndToEnd {
        return Ok((predictors, None));
    }
    let began = Instant::now();
    let trained = end_to_end(scenery).context("the end-to-end response cannot be trained")?;
    let remark = format!(
        "the end-to-end response learnt from {} simulated demonstrations of hand and joints, of {PEOPLE} people none of whom is judged, in {:.1} s ({})",
        trained.1,
        began.elapsed().as_secs_f64(),
        untaught_line(&taught_tasks(scenery.scene, trained.1))
    );
    Ok((predictors.with_response(trained.0), Some(remark)))
}

/// What an answered reach was for.
#[derive(Debug, Clone)]
pub struct Answered {
    /// The hand.
    pub reach: LabelledReach,
    /// The hand and the arm.
    pub shown: ResponseDemonstration,
    /// What was touched.
    pub surface: SurfaceId,
    /// Where the middle of the face is in the end, m.
    pub target: BoardTarget,
}

/// The arm's answers to what some people do in a scene: those of these numbers, with so many reaches of each. What is out of the
/// arm's reach is left out.
///
/// A hand that grasps meets the edge of the board: its middle is a grip's depth less than half its height below the fingertip.
///
/// # Errors
/// A scene in which they find nothing to touch; an arm without a waiting posture.
pub fn answered(
    scenery: &Scenery<'_>,
    task: Task,
    people: Range<u64>,
    reaches: usize,
) -> anyhow::Result<Vec<Answered>> {
    let Scenery { scene, board, .. } = *scenery;
    let (arm, walls) = (scenery.arm, scenery.walls);
    let waiting = walls.waiting.context("the arm has nowhere to wait")?;
    let demonstrator = Demonstrator::new(arm.kinematics(), board, scene, &waiting)?;
    let levels = match scenery.textured {
        true => TextureLevels::for_scene(scene, board)?,
        false => None,
    };
    let streams = streams_of(scene, arm, scenery.people, people, reaches)?;
    let mut all = Vec::new();
    for reach in training::reaches(&streams)? {
        let Some(normal) = reach.normal else { continue };
        let Some(place) = scene.closest_touchable(reach.contact_m, ON_IT_M)? else {
            continue;
        };
        let point_m = match task {
            Task::Grasp => {
                let [_, up] = surface_axes(normal)?;
                reach.contact_m - up * (board.half_height_m - GRIP_M)
            }
            _ => reach.contact_m,
        };
        let roughness = scene.surface(place.surface).roughness;
        let roll_rad = |roughness| levels.as_ref().and_then(|l| l.roll_of_rad(roughness));
        let entry = walls.atlas.as_ref();
        let entry = entry.and_then(|atlas| atlas.look_up(point_m, normal));
        let target = BoardTarget {
            roll_rad: roughness.and_then(roll_rad),
            near: entry.map(|entry| entry.q),
            ..BoardTarget::new(point_m, normal, 0.0)
        };
        if let Some(shown) = demonstrator.answer(task, &reach.frames, &target)? {
            all.push(Answered {
                reach,
                shown,
                surface: place.surface,
                target,
            });
        }
    }
    Ok(all)
}

/// The predictor, and how many demonstrations it learnt from.
///
/// # Errors
/// As [`answered`]; too few of them.
pub fn end_to_end(scenery: &Scenery<'_>) -> anyhow::Result<(EndToEnd, usize)> {
    let answered = answered(scenery, Task::Touch, 0..PEOPLE, TOUCHES)?;
    let shown: Vec<ResponseDemonstration> = answered.into_iter().map(|a| a.shown).collect();
    ensure!(
        shown.len() >= LEAST,
        "the arm can answer {} of the simulated reaches only, {LEAST} are needed",
        shown.len()
    );
    let model = ResponseModel::train(&shown, &ResponseConfig::default())?;
    let predictor = EndToEnd::new(&model, Arc::clone(scenery.arm.kinematics()))?;
    Ok((predictor, shown.len()))
}
