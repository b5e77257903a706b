//! The end-to-end response among the estimators of the contact study.

use crate::contact::candidates::{BoxedEstimator, Candidate, Role};
use anyhow::{Context, ensure};
use hwall::response::{Demonstrator, ResponseConfig, ResponseEstimator, ResponseModel, Task};
use hwall_hand::LabelledReach;
use hwall_haptics::{Board, BoardTarget};
use hwall_kinematics::{ArmKinematics, JointPositions, SrsArm};
use hwall_scene::Scene;
use std::sync::Arc;

/// A far wall that does not interfere: the panels of the study are not surfaces of a scene.
const FAR_WALL: &str = "o wall\nv 9 -1 0\nv 9 1 0\nv 9 1 2\nv 9 -1 2\nf 1 2 3 4\n";
/// Waiting posture: board upright, 8 cm behind the wall, in its middle.
const WAITS_DEG: [f64; 7] = [0.0, 0.0, 0.0, -110.0, 0.0, -20.0, 90.0];
/// Least number of demonstrations.
const LEAST: usize = 8;

/// The middle of the board by forward kinematics of the posterior over joints, for touches that the arm of the study can
/// present.
pub fn candidate() -> Candidate {
    Candidate {
        name: "end-to-end, middle of the board".to_owned(),
        role: Role::Baseline,
        train: Box::new(train),
    }
}

fn train(reaches: &[&LabelledReach]) -> anyhow::Result<BoxedEstimator> {
    let (model, arm) = taught(reaches)?;
    Ok(Box::new(ResponseEstimator::new(&model, arm)))
}

/// The trained model, and the demonstrating arm.
fn taught(reaches: &[&LabelledReach]) -> anyhow::Result<(ResponseModel, Arc<dyn ArmKinematics>)> {
    let board = Board::default();
    let arm = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
    let arm: Arc<dyn ArmKinematics> = Arc::new(arm);
    let waiting = JointPositions::from_deg(WAITS_DEG);
    let (scene, _) = Scene::from_obj_str(FAR_WALL, None)?;
    let teacher = Demonstrator::new(&arm, &board, &scene, &waiting)?;
    let mut shown = Vec::new();
    for reach in reaches {
        let normal = reach.normal.context("a reach for no surface")?;
        let target = BoardTarget {
            near: Some(waiting),
            ..BoardTarget::new(reach.contact_m, normal, 0.0)
        };
        shown.extend(teacher.answer(Task::Touch, &reach.frames, &target)?);
    }
    ensure!(
        shown.len() >= LEAST,
        "the arm can present {} of the touched places, {LEAST} are needed",
        shown.len()
    );
    let model = ResponseModel::train(&shown, &ResponseConfig::default())?;
    Ok((model, arm))
}
