//! The end-to-end response among the estimators of the contact study.

use crate::contact::candidates::{BoxedEstimator, Candidate, Role};
use crate::demonstrations::generate::WAITS_DEG;
use anyhow::{Context, ensure};
use hwall::response::{
    Demonstrator, EndToEnd, ResponseConfig, ResponseEstimator, ResponseModel, Task,
};
use hwall_hand::LabelledReach;
use hwall_haptics::{Board, BoardTarget};
use hwall_kinematics::{ArmKinematics, JointPositions, SrsArm};
use hwall_scene::Scene;
use std::borrow::Borrow;
use std::sync::Arc;

/// A wall that is in nobody's way: the panels of the study are no surfaces of a scene.
const FAR_WALL: &str = "o wall\nv 9 -1 0\nv 9 1 0\nv 9 1 2\nv 9 -1 2\nf 1 2 3 4\n";
/// Fewer demonstrations teach nothing.
const LEAST: usize = 8;

/// The middle of the board by forward kinematics of the posterior over the joints, where the arm of the study can present what was
/// touched.
pub fn candidate() -> Candidate {
    Candidate {
        name: "end-to-end, middle of the board".to_owned(),
        role: Role::Baseline,
        train: Box::new(train),
    }
}

/// The response as a predictor with a scene, from reaches; it names the surface next to
/// the face that it presents.
///
/// # Errors
/// The arm of the study cannot present enough of what was touched.
pub fn predictor(reaches: &[LabelledReach]) -> anyhow::Result<EndToEnd> {
    let (model, arm) = taught(reaches)?;
    Ok(EndToEnd::new(&model, arm)?)
}

fn train(reaches: &[&LabelledReach]) -> anyhow::Result<BoxedEstimator> {
    let (model, arm) = taught(reaches)?;
    Ok(Box::new(ResponseEstimator::new(&model, arm)))
}

/// The model, and the arm that demonstrated.
fn taught<R: Borrow<LabelledReach>>(
    reaches: &[R],
) -> anyhow::Result<(ResponseModel, Arc<dyn ArmKinematics>)> {
    let board = Board::default();
    let arm = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
    let arm: Arc<dyn ArmKinematics> = Arc::new(arm);
    let waiting = JointPositions::from_deg(WAITS_DEG);
    let (scene, _) = Scene::from_obj_str(FAR_WALL, None)?;
    let teacher = Demonstrator::new(&arm, &board, &scene, &waiting)?;
    let mut shown = Vec::new();
    for reach in reaches.iter().map(Borrow::borrow) {
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
