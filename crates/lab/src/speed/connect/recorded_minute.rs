//! A minute of a session: what recording costs the loop, and how large its files are.

use super::session;
use glam::DVec3;
use hwall::Cycle;
use hwall::hand::HandFrame;
use hwall::haptics::{ArmCommand, ArmState, Board};
use hwall_kinematics::{JointTorques, JointVelocities};
use hwall_record::{ArmSource, Recorder, RecorderConfig, Run, Setup, Skeleton};
use hwall_scene::Scene;
use hwall_stage::input::arms::BoardArm;
use hwall_testkit::{Sampler, Timing};
use hwall_view::{ViewFrame, ViewScene, glb, replay_page};
use std::time::Instant;

const ROOM: (&str, &str) = (
    include_str!("../../../../../examples/assets/room.obj"),
    include_str!("../../../../../examples/assets/room.toml"),
);

/// What was measured.
pub(super) struct RecordedMinute {
    /// A state and its command handed to the recorder.
    pub(super) cycle: Timing,
    /// A frame of the hand.
    pub(super) frame: Timing,
    /// What is seen, a hundred times a second.
    pub(super) view: Timing,
    pub(super) recording_bytes: usize,
    /// The replay at 30 frames a second.
    pub(super) replay_bytes: usize,
    /// The animation of the same frames.
    pub(super) glb_bytes: usize,
}

/// A hand that reaches every four seconds.
fn hand(t_s: f64) -> HandFrame {
    let (rest_m, wall_m) = (DVec3::new(1.1, 0.2, 0.4), DVec3::new(0.6, 0.1, 0.6));
    let phase_s = t_s % 4.0;
    let s = (phase_s / 1.2).clamp(0.0, 1.0) - ((phase_s - 2.2) / 0.8).clamp(0.0, 1.0);
    let at_m = rest_m.lerp(wall_m, s * s * (3.0 - 2.0 * s));
    let head_m = DVec3::new(1.4, 0.0, 1.3);
    HandFrame {
        palm_m: Some(at_m + DVec3::X * 0.1),
        tips_m: std::array::from_fn(|i| Some(at_m + DVec3::Y * 0.02 * (i as f64 - 1.0))),
        head_m: Some(head_m),
        gaze: Some((wall_m - head_m).normalize()),
        ..HandFrame::empty(t_s)
    }
}

/// `seconds` of a session in the built-in room, as fast as they come: cycles at 1 kHz, frames at 91 Hz, views at 100 Hz.
///
/// # Errors
/// A file that cannot be written, or whatever the crates refuse.
pub(super) fn measure(seed: u64, seconds: u32) -> anyhow::Result<RecordedMinute> {
    let board = Board::default();
    let arm = BoardArm::named("iiwa7", &board)?;
    let (scene, _) = Scene::from_obj_str(ROOM.0, Some(ROOM.1))?;
    let skeleton = Skeleton::new(&arm.links()?, &**arm.kinematics(), &board)?;
    let setup = Setup {
        program: "speed_against_error".to_owned(),
        scene_obj: ROOM.0.to_owned(),
        scene_sidecar: Some(ROOM.1.to_owned()),
        arm: ArmSource::Named("iiwa7".to_owned()),
        board,
        options: Vec::new(),
    };
    let name = format!("hwall-speed-{}.mcap", std::process::id());
    let path = std::env::temp_dir().join(name);
    let config = RecorderConfig::simulated();
    let mut recorder = Recorder::create(&path, &setup, skeleton, &scene, &config)?;
    let mut session = session::ray_led(&arm, &board, scene)?;
    let view_scene = ViewScene::of("a minute", &session)?;
    recorder.begin(Run::default());
    let mut noise = Sampler::new(seed);
    let mut q = arm.start();
    let (mut cycles, mut frames, mut views) = (Vec::new(), Vec::new(), Vec::new());
    let mut seen = Vec::new();
    let mut newest = HandFrame::empty(0.0);
    let timed = |samples: &mut Vec<f64>, f: &mut dyn FnMut()| {
        let began = Instant::now();
        f();
        samples.push(1e9 * began.elapsed().as_secs_f64());
    };
    for i in 0..1000 * seconds {
        let t_s = 1e-3 * f64::from(i);
        if i % 11 == 0 {
            newest = hand(t_s);
            timed(&mut frames, &mut || recorder.frame(&newest));
            session.frame(&newest);
        }
        let mut state = ArmState {
            t_s,
            q,
            qd: JointVelocities::default(),
            external_torque: Some(JointTorques::default()),
        };
        for angle in &mut state.q.0 {
            *angle += 1e-6 * noise.normal();
        }
        let command = session.step(t_s, &state);
        session.plan();
        if let ArmCommand::Position(told) = command {
            q = told;
        }
        let cycle = Cycle {
            t_s,
            state,
            command,
        };
        timed(&mut cycles, &mut || recorder.cycle(&cycle));
        if i % 10 == 0 {
            timed(&mut views, &mut || recorder.view(&session, &cycle));
        }
        if i % 33 == 0 {
            seen.push(ViewFrame::of(&session, &state, Some(&newest)));
        }
        while let Some(event) = session.next_event() {
            recorder.event(&event);
        }
    }
    let summary = recorder.finish();
    let _ = std::fs::remove_file(&path);
    Ok(RecordedMinute {
        cycle: Timing::from_samples_ns(cycles),
        frame: Timing::from_samples_ns(frames),
        view: Timing::from_samples_ns(views),
        recording_bytes: summary?.bytes as usize,
        replay_bytes: replay_page(&view_scene, &seen, &[]).len(),
        glb_bytes: glb(&view_scene, &seen).len(),
    })
}
