//! Preparation of a live session: scene, walls, predictor, recording.

use super::flags::LiveFlags;
use super::recorded;
use crate::input::arms::BoardArm;
use crate::input::floor_pose::FloorPose;
use crate::person::kinds::PersonKind;
use crate::person::participants;
use crate::person::predictors::{PredictorKind, TrainingPeople, fused};
use crate::person::responses::{self, Scenery};
use crate::recording::SessionSource;
use crate::setting::load_scene;
use anyhow::ensure;
use hwall::contact::{DeterministicPredictor, Predictor};
use hwall::haptics::Board;
use hwall::{LikelyTouches, Session};
use hwall_bridge::BridgeServer;
use hwall_kinematics::JointPositions;
use hwall_record::Recorder;
use std::time::Instant;

/// A prepared session.
pub struct Prepared {
    /// The session.
    pub session: Session<Box<dyn Predictor + Send>>,
    /// The arm, with the face of its board as its tool.
    pub arm: BoardArm,
    /// Its waiting posture, rad.
    pub start: JointPositions,
    /// For the user: what was chosen or learnt.
    pub remarks: Vec<String>,
    /// The recording, if requested.
    pub(super) recorder: Option<Recorder>,
}

/// Reads the scene, computes its walls, trains a predictor and begins the recording. Tells the clients of a server about slow
/// steps.
///
/// # Errors
/// A scene that is missing or malformed; a configuration that a crate refuses; a recording that cannot be written; a server that
/// is stopped meanwhile. [`LiveFlags::check`] finds file errors before a server is started.
pub fn prepare(server: &BridgeServer, flags: &LiveFlags) -> anyhow::Result<Prepared> {
    let next = |text: &str| -> anyhow::Result<()> {
        ensure!(!server.is_stopped(), "stopped before: {text}");
        server.prepare(text);
        Ok(())
    };
    let began = Instant::now();
    let arm = BoardArm::named("iiwa7", &Board::default())?;
    next("reading the scene")?;
    let base = FloorPose::ORIGIN;
    let (scene, mut remarks) = load_scene(flags.scene.file())?;
    let scene = base.scene_seen(&scene)?;
    // Likely touches of people standing in the scene.
    let likely_touches = match participants::simulated(&scene, &arm, PersonKind::Plain, 1, 1) {
        Ok(people) => participants::likely_touches(&scene, &arm, &people),
        Err(nobody) => {
            remarks.push(format!("any place may be touched: {nobody:#}"));
            LikelyTouches::default()
        }
    };
    next("mapping where the arm can hold its board")?;
    let walls = arm.walls_of(&scene, likely_touches.clone(), true)?;
    next("learning how people reach")?;
    let people = TrainingPeople::default();
    let scenery = Scenery::of(&scene, &arm, &walls, &people);
    let (predictor, leader, learnt) = predictor(&scenery, flags.predictor)?;
    remarks.push(learnt);
    remarks.extend(flags.led.warning());
    let room = flags.led.real_room()?;
    let settings = flags
        .led
        .session(scenery, room.as_ref(), flags.fri.is_some());
    let session = settings.session(predictor)?;
    let source = SessionSource {
        scene: flags.scene.file(),
        arm: &"iiwa7".into(),
        room: room.as_ref().map(|read| read.text.as_str()),
        base,
        scenery,
        level: flags.led.arm_level,
        predictor: leader,
        adapts: true,
        likely_touches: &likely_touches,
    };
    let recorder = recorded::begin(flags, &source, &settings)?;
    let prepared_s = began.elapsed().as_secs_f64();
    remarks.push(format!("prepared in {prepared_s:.1} s"));
    Ok(Prepared {
        session,
        start: scenery.start(),
        arm,
        remarks,
        recorder,
    })
}

/// The requested predictor, and a line about it; by default the fused predictor, or the ray-led one without training
/// data.
fn predictor(
    scenery: &Scenery<'_>,
    asked: Option<PredictorKind>,
) -> anyhow::Result<(Box<dyn Predictor + Send>, PredictorKind, String)> {
    let ray = |kind: PredictorKind, line: String| -> anyhow::Result<_> {
        let predictor = DeterministicPredictor::new(kind.ray_config())?;
        let predictor: Box<dyn Predictor + Send> = Box::new(predictor);
        Ok((predictor, kind, line))
    };
    match asked {
        Some(kind @ (PredictorKind::RayLed | PredictorKind::RayCast)) => {
            return ray(kind, format!("the {} predictor", kind.name()));
        }
        Some(PredictorKind::EndToEnd) => {
            let (response, shown) = responses::end_to_end(scenery)?;
            let untaught = responses::untaught_line(scenery.scene);
            let line = format!(
                "the end-to-end response learnt from {shown} simulated demonstrations ({untaught})"
            );
            return Ok((Box::new(response), PredictorKind::EndToEnd, line));
        }
        Some(PredictorKind::Fused) | None => {}
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
    use clap::Parser;

    #[test]
    fn nothing_is_prepared_for_a_server_that_is_stopped() {
        let flags = LiveFlags::parse_from(["", "--listen", "127.0.0.1:0"]);
        let server = BridgeServer::start(flags.server().unwrap()).expect("a server");
        server.stop_handle().stop();
        let stopped = prepare(&server, &flags).err().expect("an error");
        assert!(stopped.to_string().contains("stopped"), "{stopped}");
    }
}
