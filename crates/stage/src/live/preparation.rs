//! What a live session needs before anybody touches: a scene, its walls, a predictor.

use crate::input::arms::BoardArm;
use crate::person::kinds::PersonKind;
use crate::person::predictors::{TrainingPeople, fused};
use crate::run::simulated_arm::ArmLevel;
use crate::setting::{Setting, SettingOptions, load_scene};
use anyhow::Context;
use clap::ValueEnum;
use hwall::contact::{DeterministicConfig, DeterministicPredictor, Predictor};
use hwall::hand::HandFilterConfig;
use hwall::haptics::Board;
use hwall::{LikelyTouches, Session, SessionConfig};
use hwall_bridge::{BridgeServer, FollowedHand};
use hwall_kinematics::JointPositions;
use hwall_scene::Scene;
use std::path::Path;
use std::time::Instant;

/// Which hand the board serves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum HandChoice {
    /// The left one
    Left,
    /// The right one; a mouse counts as one
    #[default]
    Right,
    /// The one that is seen first, the other one when that is lost
    Either,
}

impl From<HandChoice> for FollowedHand {
    fn from(hand: HandChoice) -> Self {
        match hand {
            HandChoice::Left => Self::Left,
            HandChoice::Right => Self::Right,
            HandChoice::Either => Self::Either,
        }
    }
}

/// What the command line asks for.
pub struct LiveOptions<'a> {
    /// OBJ file; `None`: the built-in room.
    pub scene: Option<&'a Path>,
    /// How much of the arm is simulated.
    pub level: ArmLevel,
    /// Does a hand that stands quite still count as lost? For headsets, whose hands tremble.
    pub watch_frozen: bool,
    /// End after this time, s.
    pub seconds: Option<f64>,
    /// Seed of the sensors' noise.
    pub seed: u64,
}

/// Ready to touch.
pub struct Prepared {
    /// The session.
    pub session: Session<Box<dyn Predictor + Send>>,
    /// The arm, with the face of the board as its tool.
    pub arm: BoardArm,
    /// The board.
    pub board: Board,
    /// Where the arm waits, rad.
    pub start: JointPositions,
    /// What was chosen or learnt, for the user.
    pub remarks: Vec<String>,
}

/// Reads the scene, finds out about its walls and trains a predictor, telling the clients of a server what takes time.
///
/// # Errors
/// A scene that is missing or malformed; a configuration that a crate refuses.
pub fn prepare(server: &BridgeServer, options: &LiveOptions<'_>) -> anyhow::Result<Prepared> {
    let began = Instant::now();
    let board = Board::default();
    let arm = BoardArm::named("iiwa7", &board)?;
    server.prepare("reading the scene");
    let (scene, likely_touches, mut remarks) = scene_and_touches(&arm, options)?;
    server.prepare("learning how people reach");
    let (predictor, learnt) = predictor(&scene, &arm)?;
    remarks.push(learnt);
    server.prepare("mapping where the arm can hold its board");
    let walls = arm.walls_of(&scene, &board, likely_touches, true)?;
    let start = walls.waiting.unwrap_or(arm.start());
    let hand = match options.watch_frozen {
        true => HandFilterConfig::default(),
        false => HandFilterConfig::simulated(),
    };
    let config = SessionConfig {
        hand,
        object_command: options.level.object_command(&arm, &board)?,
        ..SessionConfig::default()
    };
    let session = Session::new(&**arm.kinematics(), &board, scene, walls, predictor, config)?;
    remarks.push(format!(
        "prepared in {:.1} s",
        began.elapsed().as_secs_f64()
    ));
    Ok(Prepared {
        session,
        arm,
        board,
        start,
        remarks,
    })
}

/// The scene, and where people who stand in it would touch.
fn scene_and_touches(
    arm: &BoardArm,
    options: &LiveOptions<'_>,
) -> anyhow::Result<(Scene, LikelyTouches, Vec<String>)> {
    let setting = Setting::new(
        arm,
        &SettingOptions {
            scene: options.scene,
            hand: None,
            y_up: false,
            auto: false,
            base: None,
            base_by_arrival: false,
            hand_origin: None,
            rigid_hand: false,
            person: PersonKind::Plain,
            touches: 1,
            seed: 1,
        },
    );
    match setting {
        Ok(setting) => Ok((setting.scene, setting.likely_touches, setting.remarks)),
        Err(nobody) => {
            let (scene, mut remarks) = load_scene(options.scene)?;
            remarks.push(format!("any place may be touched: {nobody:#}"));
            Ok((scene, LikelyTouches::default(), remarks))
        }
    }
}

/// The fused predictor, or the ray-led one where there is nobody to learn from; and a line about it.
fn predictor(scene: &Scene, arm: &BoardArm) -> anyhow::Result<(Box<dyn Predictor + Send>, String)> {
    match fused(scene, arm, &TrainingPeople::default()) {
        Ok((fused, reaches)) => Ok((
            Box::new(fused),
            format!("the predictor learnt from {reaches} simulated reaches"),
        )),
        Err(error) => {
            let ray_led = DeterministicPredictor::new(DeterministicConfig::ray_led())
                .context("the ray-led predictor")?;
            Ok((
                Box::new(ray_led),
                format!("the ray-led predictor, nobody to learn from: {error:#}"),
            ))
        }
    }
}
