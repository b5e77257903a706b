//! The estimators that are compared.

use anyhow::{Context, ensure};
use hwall::response::{Demonstrator, ResponseConfig, ResponseEstimator, ResponseModel, Task};
use hwall_contact::{
    Combination, ConstantVelocity, ContactError, ContactEstimator, Hold, LearnedConfig,
    LearnedEstimator, LearnedModel, MinimumJerk, NearestNeighbour, RidgeWindow,
};
use hwall_hand::LabelledReach;
use hwall_haptics::{Board, BoardTarget};
use hwall_kinematics::{ArmKinematics, JointPositions, SrsArm};
use hwall_scene::Scene;
use std::sync::Arc;

/// A trained estimator, for held-out reaches.
pub type BoxedEstimator = Box<dyn ContactEstimator + Send>;

/// Trains an estimator; called once per fold, in parallel.
pub type TrainFn = Box<dyn Fn(&[&LabelledReach]) -> anyhow::Result<BoxedEstimator> + Sync>;

/// Role of a candidate in the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A baseline for the learned estimator.
    Baseline,
    /// A part of the learned estimator, to show its contribution.
    Part,
    /// The learned estimator.
    Learned,
}

/// One estimator of the end of a reach.
pub struct Candidate {
    /// For tables and legends.
    pub name: String,
    /// Its role.
    pub role: Role,
    /// Trains it.
    pub train: TrainFn,
}

/// All candidates, in the order of the tables; `config`: for the learned estimator and its parts.
pub fn all(config: LearnedConfig) -> Vec<Candidate> {
    let of = |combination, name, role| Candidate {
        role,
        ..Candidate::of(name, learned(combination, config))
    };
    vec![
        Candidate::of("hold", |r| Hold::train(r)),
        Candidate::of("constant velocity", |r| ConstantVelocity::train(r)),
        Candidate::of("minimum jerk", |r| MinimumJerk::train(r)),
        Candidate::of("nearest neighbours", |r| NearestNeighbour::train(r)),
        Candidate::of("ridge on five frames", |r| RidgeWindow::train(r)),
        of(
            Combination::Primitive,
            "interaction primitive",
            Role::Baseline,
        ),
        of(Combination::Regression, "local regression", Role::Part),
        of(Combination::Both, "learned", Role::Learned),
    ]
}

/// The learned estimator, or one of its two sources.
fn learned(
    combination: Combination,
    config: LearnedConfig,
) -> impl Fn(&[&LabelledReach]) -> Result<LearnedEstimator, ContactError> {
    let config = LearnedConfig {
        combination,
        ..config
    };
    move |reaches| Ok(LearnedModel::train(reaches, &config)?.estimator())
}

impl Candidate {
    /// A baseline.
    pub fn of<E: ContactEstimator + Send + 'static>(
        name: &str,
        train: impl Fn(&[&LabelledReach]) -> Result<E, ContactError> + Sync + 'static,
    ) -> Self {
        Self {
            name: name.to_owned(),
            role: Role::Baseline,
            train: Box::new(move |reaches| Ok(Box::new(train(reaches)?))),
        }
    }
}

/// A far wall that does not interfere: the panels of the study are not surfaces of a scene.
const FAR_WALL: &str = "o wall\nv 9 -1 0\nv 9 1 0\nv 9 1 2\nv 9 -1 2\nf 1 2 3 4\n";
/// Waiting posture: board upright, 8 cm behind the wall, in its middle.
const WAITS_DEG: [f64; 7] = [0.0, 0.0, 0.0, -110.0, 0.0, -20.0, 90.0];
/// Least number of demonstrations.
const LEAST: usize = 8;

/// The middle of the board by forward kinematics of the posterior over joints, for touches that the arm of the study can
/// present.
pub fn end_to_end() -> Candidate {
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
