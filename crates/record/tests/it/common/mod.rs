//! A session in front of a door, an ideal arm, and a hand that touches: everything that a recording can contain.

#![allow(dead_code)] // benches use a part

use glam::DVec3;
use hwall::contact::{DeterministicConfig, DeterministicPredictor};
use hwall::geometry::{Pose, Wrench};
use hwall::hand::{Bystanders, HandFilterConfig, HandFrame};
use hwall::haptics::{ArmCommand, ArmState, Board};
use hwall::kinematics::{ArmKinematics, Chain, JointPositions, JointVelocities, SrsArm};
use hwall::scene::Scene;
use hwall::{Controller, Cycle, Session, SessionConfig, WorldPose, maps_of};
use hwall_record::{
    ArmSource, RecordError, Recorded, Recorder, RecorderConfig, Recording, Replayed, Request, Run,
    Setup, Skeleton, Summary, replay,
};
use hwall_testkit::Sampler;
use std::path::{Path, PathBuf};
use std::time::Duration;

pub(crate) type GazeSession = Session<DeterministicPredictor>;

const OBJ: &str = "o wall\nv 0.6 -1 0\nv 0.6 -0.3 0\nv 0.6 -0.3 2\nv 0.6 -1 2\nf 1 2 3 4\n\
                   o door\nv 0.6 -0.3 0\nv 0.6 0.6 0\nv 0.6 0.6 2\nv 0.6 -0.3 2\nf 5 6 7 8\n";
const SIDECAR: &str = "[surface.door]\nkind = \"revolving_door\"\nhinge_point_m = [0.6, -0.3, 0.0]\n\
                       hinge_axis = [0.0, 0.0, 1.0]\nrange_deg = [0.0, 60.0]\ninertia_kg_m2 = 0.8\n\
                       damping_n_m_s_per_rad = 12.0\n";

pub(crate) fn setup() -> Setup {
    Setup {
        program: "a test".to_owned(),
        scene_obj: OBJ.to_owned(),
        scene_sidecar: Some(SIDECAR.to_owned()),
        arm: ArmSource::Named("iiwa7".to_owned()),
        board: Board::default(),
        options: vec![("seed".to_owned(), "7".to_owned())],
    }
}

pub(crate) fn scene_of(setup: &Setup) -> Scene {
    let scene = Scene::from_obj_str(&setup.scene_obj, setup.scene_sidecar.as_deref());
    scene.expect("a scene").0
}

pub(crate) fn iiwa(board: &Board) -> SrsArm {
    SrsArm::iiwa7().with_tool(board.flange_from_board_face().expect("a board"))
}

pub(crate) fn skeleton() -> Skeleton {
    let board = Board::default();
    Skeleton::new(&Chain::iiwa7(), &iiwa(&board), &board).expect("the same arm")
}

pub(crate) fn session_of(setup: &Setup) -> GazeSession {
    let (scene, arm) = (scene_of(setup), iiwa(&setup.board));
    let maps = maps_of(&scene, &arm).expect("maps");
    let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led()).expect("limits");
    let config = SessionConfig {
        hand: HandFilterConfig::simulated(),
        ..SessionConfig::default()
    };
    Session::new(&arm, &setup.board, scene, maps, predictor, config).expect("a session")
}

/// The path of a file with this name that no other test uses.
pub(crate) fn file(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("hwall-record-{}-{name}", std::process::id()))
}

pub(crate) fn recorder(path: &Path, config: &RecorderConfig) -> Recorder {
    let setup = setup();
    Recorder::create(path, &setup, skeleton(), &scene_of(&setup), config).expect("a recorder")
}

/// A hand that rests, reaches in 1.2 s, presses for a second, and rests again.
pub(crate) fn hand(t_s: f64) -> HandFrame {
    let (rest_m, door_m) = (DVec3::new(1.1, 0.2, 0.4), DVec3::new(0.6, 0.1, 0.6));
    let s = (t_s / 1.2).clamp(0.0, 1.0) - ((t_s - 2.2) / 0.8).clamp(0.0, 1.0);
    let at_m = rest_m.lerp(door_m, s * s * (3.0 - 2.0 * s));
    let mut frame = HandFrame::empty(t_s);
    frame.palm_m = Some(at_m + DVec3::X * 0.1);
    frame.tips_m[1] = Some(at_m);
    // A driver's NaN is an input like any other.
    frame.body_m[3] = (t_s > 0.1).then_some(at_m + DVec3::Z * 0.3);
    frame.other_hand_m = (t_s > 0.2).then_some(at_m + DVec3::Y * 0.4);
    frame.tips_m[4] = ((t_s / 0.1) as i64 % 7 == 3).then_some(DVec3::NAN);
    frame.head_m = Some(DVec3::new(1.4, 0.0, 1.3));
    frame.gaze = Some((door_m - DVec3::new(1.4, 0.0, 1.3)).normalize());
    let stands_m = Some(at_m + DVec3::new(1.0, 1.0, 0.5));
    frame.bystanders = (t_s > 0.3).then(|| Bystanders::new(&[stands_m]).expect("one"));
    frame.is_of_another = (2.695..2.705).contains(&t_s);
    frame
}

/// One run: frames at 100 Hz, cycles at 1 kHz, occasionally a pose of the world and a request. Returns the commands.
pub(crate) fn run(recorder: &mut Recorder, number: u32, seconds: f64) -> Vec<ArmCommand> {
    let session = session_of(&setup());
    run_of(recorder, number, seconds, session, Duration::ZERO, hand)
}

/// As [`run`], for a given session, with a pause between cycles, and a given hand.
pub(crate) fn run_of(
    recorder: &mut Recorder,
    number: u32,
    seconds: f64,
    session: Session<DeterministicPredictor>,
    pause: Duration,
    hand: impl Fn(f64) -> HandFrame,
) -> Vec<ArmCommand> {
    let setup = setup();
    let arm = iiwa(&setup.board);
    let mut noise = Sampler::new(u64::from(number) + 1);
    recorder.begin(Run {
        number,
        options: vec![("who".to_owned(), format!("person {number}"))],
    });
    let mut recorded = Recorded {
        session,
        recorder: Some(recorder),
    };
    let mut q = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
    let mut commands = Vec::new();
    for number in 0..(1000.0 * seconds) as u32 {
        let now_s = 1e-3 * f64::from(number);
        if number % 10 == 0 {
            recorded.frame(&hand(now_s));
        }
        if number % 700 == 350 {
            let yaw_rad = 1e-4 * f64::from(number % 3);
            let base_from_world = Pose::from_yaw(yaw_rad, DVec3::ZERO).expect("finite");
            recorded.world(&WorldPose {
                t_s: now_s,
                base_from_world,
            });
        }
        match number {
            400 => recorded.request(Request::ClockOffset {
                arm_minus_tracker_s: 1e-3,
            }),
            2800 => recorded.request(Request::Stop),
            2850 => recorded.request(Request::Reset),
            _ => {}
        }
        let pressed = (1300..2200).contains(&number);
        let wrench = Wrench {
            force_n: DVec3::NEG_X * if pressed { 6.0 } else { 0.0 },
            ..Wrench::default()
        };
        let measured = JointPositions(q.0.map(|q| q + 1e-6 * noise.normal()));
        let state = ArmState {
            t_s: now_s,
            q: measured,
            qd: JointVelocities(std::array::from_fn(|_| 1e-5 * noise.normal())),
            external_torque: Some(arm.torques_from_wrench(&measured, &wrench)),
        };
        let command = recorded.step(now_s, &state);
        recorded.plan();
        std::thread::sleep(pause);
        if let ArmCommand::Position(told) = command {
            q = told;
        }
        let cycle = Cycle {
            t_s: now_s,
            state,
            command,
        };
        let Recorded { session, recorder } = &mut recorded;
        if let Some(recorder) = recorder {
            recorder.view(session, &cycle);
            while let Some(event) = session.next_event() {
                recorder.event(&event);
            }
        }
        commands.push(command);
    }
    commands
}

/// A finished recording of `seconds`, in one run.
pub(crate) fn recorded(path: &Path, seconds: f64) -> Summary {
    let config = RecorderConfig {
        chunk_bytes: 64 * 1024,
        ..RecorderConfig::simulated()
    };
    let mut recorder = recorder(path, &config);
    run(&mut recorder, 0, seconds);
    recorder.finish().expect("a file")
}

/// A recording; its file is deleted after reading.
pub(crate) fn taken(path: &Path) -> Recording {
    let recording = Recording::open(path).expect("a recording");
    std::fs::remove_file(path).expect("its file");
    recording
}

/// Replays with the same session.
pub(crate) fn again(recording: &Recording) -> Replayed {
    let replayed = replay(recording, |setup, _| {
        Ok::<_, RecordError>(session_of(setup))
    });
    replayed.expect("a replay")
}
