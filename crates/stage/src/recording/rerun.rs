//! The sessions of a recording, made again.

use super::setup::{Options, run_from};
use crate::input::arms::{BoardArm, NamedArm};
use crate::person::predictors::Predictors;
use crate::person::responses::{self, Scenery};
use crate::run::session_settings::SessionSettings;
use anyhow::Context;
use hwall::haptics::Board;
use hwall::{Session, Walls};
use hwall_record::{ArmSource, Run, Setup};
use hwall_scene::Scene;

/// What the sessions of a recording share, made again from its setup: the scene read, the predictor trained, the maps
/// built once more.
pub struct Rebuilt {
    arm: BoardArm,
    board: Board,
    scene: Scene,
    walls: Walls,
    predictors: Predictors,
    options: Options,
}

impl Rebuilt {
    /// Takes some seconds: training and maps.
    ///
    /// # Errors
    /// A setup that is not one of the main job, or does not fit this build.
    pub fn new(setup: &Setup) -> anyhow::Result<Self> {
        let options = Options::of(setup)?;
        let board = setup.board;
        let arm = match &setup.arm {
            ArmSource::Named(name) => BoardArm::named(name.as_str(), &board)?,
            ArmSource::Urdf { name, text } => {
                let [root, tip] = options.ends.clone();
                let name = name.clone();
                BoardArm::from_urdf(&NamedArm { name, root, tip }, text, &board)?
            }
        };
        let texts = (setup.scene_obj.as_str(), setup.scene_sidecar.as_deref());
        let (scene, _) = Scene::from_obj_str_in(texts.0, texts.1, &options.frame)
            .context("the recorded scene")?;
        let scene = options.base.scene_seen(&scene)?;
        let (predictors, _) = Predictors::train(
            &scene,
            &arm,
            &options.training_people,
            Some(options.predictor),
        )?;
        let walls = arm.walls_of(
            &scene,
            &board,
            options.likely_touches.clone(),
            options.textured,
        )?;
        let scenery = Scenery {
            scene: &scene,
            arm: &arm,
            board: &board,
            walls: &walls,
            people: &options.training_people,
            textured: options.textured,
        };
        let (predictors, _) = responses::taught(predictors, &scenery)?;
        Ok(Self {
            arm,
            board,
            scene,
            walls,
            predictors: predictors.with_adapting(options.adapts),
            options,
        })
    }

    /// A session that has seen nobody.
    ///
    /// # Errors
    /// A run that does not say what it needs.
    pub fn session(&self, run: &Run) -> anyhow::Result<Session<Predictors>> {
        let (filter, sees_head, arm_minus_tracker_s) = run_from(run)?;
        let settings = SessionSettings {
            arm: &self.arm,
            board: &self.board,
            room: self.options.room.as_ref().map(|read| &read.room),
            scene: &self.scene,
            walls: &self.walls,
            textured: self.options.textured,
            level: self.options.level,
            filter,
            sees_head,
            arm_minus_tracker_s,
        };
        settings.session(self.predictors.for_another_person())
    }
}
