//! Demonstrations of hand and joints: simulated people reach in the scene, and the arm presents the touched surface.

use crate::input::arms::BoardArm;
use crate::person::predictors::{PredictorKind, Predictors, TrainingPeople, streams_of};
use crate::person::training;
use anyhow::{Context, ensure};
use hwall::Walls;
use hwall::haptics::{BoardTarget, surface_axes};
use hwall::kinematics::JointPositions;
use hwall::response::{
    Demonstrator, EndToEnd, ResponseConfig, ResponseDemonstration, ResponseModel, Task,
};
use hwall::texture::TextureLevels;
use hwall_hand::LabelledReach;
use hwall_scene::{Scene, SurfaceId, SurfaceKind};
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

/// People who demonstrate to the main job, and touches of each. More than the other predictors use, because each part of
/// the joints' range needs its own demonstrations.
pub const PEOPLE: u64 = 24;
/// See [`PEOPLE`].
pub const TOUCHES: usize = 24;
/// Least number of demonstrations.
const LEAST: usize = 24;
/// Largest distance of a point on a surface, m.
const ON_IT_M: f64 = 0.05;
/// Depth of the board's edge inside a grip, m.
const GRIP_M: f64 = 0.02;

/// Scene, arm and people of the demonstrations.
#[derive(Clone, Copy)]
pub struct Scenery<'a> {
    /// The scene, in the arm's base frame.
    pub scene: &'a Scene,
    /// The arm, with the face of the board as its tool.
    pub arm: &'a BoardArm,
    /// The arm's waiting posture and presenting configurations.
    pub walls: &'a Walls,
    /// The demonstrators.
    pub people: &'a TrainingPeople,
    /// Does the board present the roughness of surfaces, which takes a roll of its own?
    pub textured: bool,
}

impl<'a> Scenery<'a> {
    /// With a board that presents the roughness of surfaces.
    #[must_use]
    pub const fn of(
        scene: &'a Scene,
        arm: &'a BoardArm,
        walls: &'a Walls,
        people: &'a TrainingPeople,
    ) -> Self {
        Self {
            scene,
            arm,
            walls,
            people,
            textured: true,
        }
    }

    /// As `textured` says.
    #[must_use]
    pub const fn textured(self, textured: bool) -> Self {
        Self { textured, ..self }
    }

    /// The arm's waiting posture; its start posture if it has none.
    #[must_use]
    pub fn start(&self) -> JointPositions {
        self.walls.waiting.unwrap_or(self.arm.start())
    }
}

/// The tasks that the main job does not train, each with its reason. The example `end_to_end` trains all three and evaluates how
/// well they are distinguished.
///
/// Distinguishing a push from a touch would not change the arm's goal: movable surfaces are also presented with the middle of
/// the board under the fingertip. A scene does not state graspable edges, and the people of the main job touch with the
/// fingertip.
#[must_use]
pub fn untaught_line(scene: &Scene) -> String {
    let still = [SurfaceKind::Static, SurfaceKind::Untouchable];
    let gives_way = scene.surfaces().iter().any(|s| !still.contains(&s.kind));
    let push = match gives_way {
        true => "what gives way is presented as for a touch",
        false => "nothing in the scene gives way",
    };
    let grasp = "a scene does not say what can be grasped";
    let untaught = [(Task::Push, push), (Task::Grasp, grasp)];
    let untaught = untaught.map(|(task, why)| format!("no {}: {why}", task.name()));
    untaught.join("; ")
}

/// The predictors, with the end-to-end response trained if it leads, and in that case a line for the user about the training.
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
    let (response, shown) = end_to_end(scenery)?;
    let remark = format!(
        "the end-to-end response learnt from {shown} simulated demonstrations of hand and joints, of {PEOPLE} people none of whom is judged, in {:.1} s ({})",
        began.elapsed().as_secs_f64(),
        untaught_line(scenery.scene)
    );
    Ok((predictors.with_response(response), Some(remark)))
}

/// A reach and the arm's demonstrated response.
#[derive(Debug, Clone)]
pub struct Answered {
    /// The hand.
    pub reach: LabelledReach,
    /// The hand and the arm.
    pub shown: ResponseDemonstration,
    /// The touched surface.
    pub surface: SurfaceId,
    /// Final position of the middle of the face, m.
    pub target: BoardTarget,
}

/// The arm's responses to reaches in a scene: of people with these numbers, with this many reaches each. Unreachable touches
/// are left out.
///
/// A grasping hand meets the edge of the board: the board's middle is half its height, less the depth of the grip, below the fingertip.
///
/// # Errors
/// A scene in which they find nothing to touch; an arm without a waiting posture.
pub fn answered(
    scenery: &Scenery<'_>,
    task: Task,
    people: Range<u64>,
    reaches: usize,
) -> anyhow::Result<Vec<Answered>> {
    let Scenery {
        scene, arm, walls, ..
    } = *scenery;
    let board = arm.board();
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

/// The predictor, and the number of training demonstrations.
///
/// # Errors
/// As [`answered`]; too few of them.
pub fn end_to_end(scenery: &Scenery<'_>) -> anyhow::Result<(EndToEnd, usize)> {
    let trained = || -> anyhow::Result<_> {
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
    };
    trained().context("the end-to-end response cannot be trained")
}
