//! Rebuilds the sessions of a recording.

use super::runs::set_from;
use super::setup::Options;
use crate::input::arms::{BoardArm, NamedArm};
use crate::person::predictors::Predictors;
use crate::person::responses::{self, Scenery};
use crate::run::stage::SessionSettings;
use anyhow::Context;
use hwall::{Session, Walls};
use hwall_record::{ArmSource, Run, Setup};
use hwall_scene::Scene;

/// The shared parts of a recording's sessions, rebuilt from its setup: scene, trained predictor and
/// maps.
pub struct Rebuilt {
    arm: BoardArm,
    scene: Scene,
    walls: Walls,
    predictors: Predictors,
    options: Options,
}

impl Rebuilt {
    /// Takes some seconds: training and maps.
    ///
    /// # Errors
    /// A setup that is not of the main job, or incompatible with this build.
    pub fn new(setup: &Setup) -> anyhow::Result<Self> {
        let options = Options::of(setup)?;
        let arm = match &setup.arm {
            ArmSource::Named(name) => BoardArm::named(name.as_str(), &setup.board)?,
            ArmSource::Urdf { name, text } => {
                let [root, tip] = options.ends.clone();
                let name = name.clone();
                BoardArm::from_urdf(&NamedArm { name, root, tip }, text, &setup.board)?
            }
        };
        let texts = (setup.scene_obj.as_str(), setup.scene_sidecar.as_deref());
        let (scene, _) = Scene::from_obj_str_in(texts.0, texts.1, &options.frame)
            .context("the recorded scene")?;
        let scene = options.base.scene_seen(&scene)?;
        let (people, leader) = (&options.training_people, Some(options.predictor));
        let (predictors, _) = Predictors::train(&scene, &arm, people, leader)?;
        let walls = arm.walls_of(&scene, options.likely_touches.clone(), options.textured)?;
        let scenery = Scenery::of(&scene, &arm, &walls, people).textured(options.textured);
        let (predictors, _) = responses::taught(predictors, &scenery)?;
        Ok(Self {
            predictors: predictors.with_adapting(options.adapts),
            arm,
            scene,
            walls,
            options,
        })
    }

    /// A fresh session.
    ///
    /// # Errors
    /// A run without a required option.
    pub fn session(&self, run: &Run) -> anyhow::Result<Session<Predictors>> {
        let people = &self.options.training_people;
        let scenery = Scenery::of(&self.scene, &self.arm, &self.walls, people);
        let mut settings = SessionSettings {
            room: self.options.room.as_ref().map(|read| &read.room),
            level: self.options.level,
            ..SessionSettings::of(scenery.textured(self.options.textured))
        };
        set_from(run, &mut settings)?;
        settings.session(self.predictors.for_another_person())
    }
}
