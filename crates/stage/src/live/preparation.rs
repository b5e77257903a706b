//! What a live session needs before anybody touches: a scene, its walls, a predictor.

use super::LiveArm;
use crate::input::arms::BoardArm;
use crate::input::file_plan::FilePlan;
use crate::input::floor_pose::FloorPose;
use crate::input::real_room::RealRoom;
use crate::input::recording_units::RecordingUnits;
use crate::input::scene_file::SceneFile;
use crate::person::kinds::PersonKind;
use crate::person::predictors::{PredictorKind, TrainingPeople, fused};
use crate::person::responses::{self, Scenery};
use crate::recording;
use crate::run::session_settings::SessionSettings;
use crate::run::simulated_arm::ArmLevel;
use crate::setting::{Setting, SettingOptions, load_scene};
use anyhow::{Context, ensure};
use clap::ValueEnum;
use hwall::contact::{DeterministicConfig, DeterministicPredictor, Predictor};
use hwall::hand::HandFilterConfig;
use hwall::haptics::Board;
use hwall::{LikelyTouches, Session};
use hwall_bridge::{BridgeServer, FollowedHand};
use hwall_kinematics::JointPositions;
use hwall_scene::Scene;
use std::net::UdpSocket;
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
    pub scene: Option<SceneFile<'a>>,
    /// What really stands around the arm; `None`: a floor.
    pub room: Option<&'a Path>,
    /// How much of the arm is simulated.
    pub level: ArmLevel,
    /// Who leads the board; `None`: the fused predictor, or the ray-led one where there is nobody to learn from.
    pub predictor: Option<PredictorKind>,
    /// Does a hand that stands quite still count as lost? For headsets, whose hands tremble.
    pub watch_frozen: bool,
    /// Does the arm move only while an enabling switch is held?
    pub enabling_switch: bool,
    /// End after this time, s.
    pub seconds: Option<f64>,
    /// Seed of the sensors' noise.
    pub seed: u64,
    /// Records the session to this file.
    pub record: Option<&'a Path>,
}

impl LiveOptions<'_> {
    fn real_room(&self) -> anyhow::Result<Option<RealRoom>> {
        let room = self.room.map(RealRoom::read);
        room.transpose().context("--room")
    }

    /// Says before anybody is served what would end the session once it is prepared: a scene or a room that cannot be read, a
    /// recording that cannot be written or would be written over the scene, an address of `arm` that cannot be listened on.
    ///
    /// # Errors
    /// The first of these.
    pub fn check(&self, arm: &LiveArm) -> anyhow::Result<()> {
        let plan = FilePlan::default()
            .read_scene("--scene", self.scene.map(|file| file.path))
            .read("--room", self.room);
        recording::planned(plan, "--record", self.record).check()?;
        load_scene(self.scene)?;
        self.real_room()?;
        let listened = match arm {
            LiveArm::Simulated => None,
            LiveArm::Fri(config) => Some(("--fri", config.listen)),
            LiveArm::Told(config) => Some(("--unity-udp", config.listen)),
        };
        if let Some((flag, address)) = listened {
            UdpSocket::bind(address).with_context(|| format!("{flag} {address}"))?;
        }
        Ok(())
    }
}

/// Whoever is served live wears a headset: the arm waits until it is tracked.
pub(super) const SEES_HEAD: bool = true;
/// The board presents the roughness of surfaces.
pub(super) const TEXTURED: bool = true;
/// Frames come on the arm's clock.
pub(super) const ARM_MINUS_TRACKER_S: f64 = 0.0;

/// Ready to touch.
pub struct Prepared {
    /// The session.
    pub session: Session<Box<dyn Predictor + Send>>,
    /// The arm, with the face of the board as its tool.
    pub arm: BoardArm,
    /// The board.
    pub board: Board,
    /// What really stands around the arm; `None`: a floor.
    pub(super) room: Option<RealRoom>,
    /// Where the arm waits, rad.
    pub start: JointPositions,
    /// What was chosen or learnt, for the user.
    pub remarks: Vec<String>,
    /// The arm's base in the scene as its file has it.
    pub(super) base: FloorPose,
    /// Who leads the board.
    pub(super) leader: PredictorKind,
    /// What the arm waits for.
    pub(super) likely_touches: LikelyTouches,
    /// How the hand is filtered.
    pub(super) filter: HandFilterConfig,
}

/// Reads the scene, finds out about its walls and trains a predictor, telling the clients of a server what takes time.
///
/// # Errors
/// A scene that is missing or malformed; a configuration that a crate refuses; a server that is stopped meanwhile.
/// [`LiveOptions::check`] finds the scene's errors before there is a server.
pub fn prepare(server: &BridgeServer, options: &LiveOptions<'_>) -> anyhow::Result<Prepared> {
    let next = |text: &str| -> anyhow::Result<()> {
        ensure!(!server.is_stopped(), "stopped before: {text}");
        server.prepare(text);
        Ok(())
    };
    let began = Instant::now();
    let board = Board::default();
    let arm = BoardArm::named("iiwa7", &board)?;
    next("reading the scene")?;
    let Place {
        scene,
        likely_touches,
        base,
        mut remarks,
    } = Place::of(&arm, options)?;
    next("mapping where the arm can hold its board")?;
    let walls = arm.walls_of(&scene, &board, likely_touches.clone(), TEXTURED)?;
    next("learning how people reach")?;
    let people = TrainingPeople::default();
    let scenery = Scenery {
        scene: &scene,
        arm: &arm,
        board: &board,
        walls: &walls,
        people: &people,
        textured: TEXTURED,
    };
    let (predictor, leader, learnt) = predictor(&scenery, options.predictor)?;
    remarks.push(learnt);
    let start = walls.waiting.unwrap_or(arm.start());
    let filter = match options.watch_frozen {
        true => HandFilterConfig::default(),
        false => HandFilterConfig::simulated(),
    };
    let room = options.real_room()?;
    let settings = SessionSettings {
        arm: &arm,
        board: &board,
        room: room.as_ref().map(|read| &read.room),
        scene: &scene,
        walls: &walls,
        textured: TEXTURED,
        level: options.level,
        filter,
        sees_head: SEES_HEAD,
        arm_minus_tracker_s: ARM_MINUS_TRACKER_S,
    };
    let session = settings.session(predictor)?;
    remarks.push(format!(
        "prepared in {:.1} s",
        began.elapsed().as_secs_f64()
    ));
    Ok(Prepared {
        session,
        arm,
        board,
        room,
        start,
        remarks,
        base,
        leader,
        likely_touches,
        filter,
    })
}

/// The scene in the frame of the arm's base, and where people who stand in it would touch.
struct Place {
    scene: Scene,
    likely_touches: LikelyTouches,
    base: FloorPose,
    remarks: Vec<String>,
}

impl Place {
    fn of(arm: &BoardArm, options: &LiveOptions<'_>) -> anyhow::Result<Self> {
        let setting = Setting::new(
            arm,
            &SettingOptions {
                scene: options.scene,
                hand: None,
                trial: None,
                units: RecordingUnits::SI,
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
            Ok(setting) => Ok(Self {
                scene: setting.scene,
                likely_touches: setting.likely_touches,
                base: setting.base,
                remarks: setting.remarks,
            }),
            Err(nobody) => {
                let (scene, mut remarks) = load_scene(options.scene)?;
                remarks.push(format!("any place may be touched: {nobody:#}"));
                Ok(Self {
                    scene,
                    likely_touches: LikelyTouches::default(),
                    base: FloorPose::ORIGIN,
                    remarks,
                })
            }
        }
    }
}

/// The one that is asked for, and a line about it; otherwise the fused predictor, or the ray-led one where there is nobody to
/// learn from.
fn predictor(
    scenery: &Scenery<'_>,
    asked: Option<PredictorKind>,
) -> anyhow::Result<(Box<dyn Predictor + Send>, PredictorKind, String)> {
    let ray = |kind: PredictorKind, line: String| -> anyhow::Result<_> {
        let config = match kind {
            PredictorKind::RayCast => DeterministicConfig::default(),
            _ => DeterministicConfig::ray_led(),
        };
        let predictor: Box<dyn Predictor + Send> = Box::new(DeterministicPredictor::new(config)?);
        Ok((predictor, kind, line))
    };
    if let Some(kind @ (PredictorKind::RayLed | PredictorKind::RayCast)) = asked {
        return ray(kind, format!("the {} predictor", kind.name()));
    }
    if asked == Some(PredictorKind::EndToEnd) {
        let (response, shown) =
            responses::end_to_end(scenery).context("the end-to-end response cannot be trained")?;
        let untaught = responses::untaught_line(&responses::taught_tasks(scenery.scene, shown));
        let line = format!(
            "the end-to-end response learnt from {shown} simulated demonstrations ({untaught})"
        );
        return Ok((Box::new(response), PredictorKind::EndToEnd, line));
    }
    match fused(scenery.scene, scenery.arm, scenery.people) {
        Ok((fused, reaches)) => Ok((
            Box::new(fused),
            PredictorKind::Fused,
            format!("the predictor learnt from {reaches} simulated reaches"),
        )),
        Err(error) if asked.is_some() => {
            Err(error.context("the fused predictor cannot be trained"))
        }
        Err(error) => ray(
            PredictorKind::RayLed,
            format!("the ray-led predictor, nobody to learn from: {error:#}"),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_bridge::BridgeConfig;

    #[test]
    fn nothing_is_prepared_for_a_server_that_is_stopped() {
        let config = BridgeConfig {
            listen: ([127, 0, 0, 1], 0).into(),
            ..BridgeConfig::default()
        };
        let server = BridgeServer::start(config).expect("a server");
        server.stop_handle().stop();
        let options = LiveOptions {
            scene: None,
            room: None,
            level: ArmLevel::Servo,
            predictor: None,
            watch_frozen: false,
            enabling_switch: false,
            seconds: None,
            seed: 1,
            record: None,
        };
        let stopped = prepare(&server, &options).err().expect("an error");
        assert!(stopped.to_string().contains("stopped"), "{stopped}");
    }
}
