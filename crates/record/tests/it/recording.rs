//! Recordings are read back bit by bit and give the same commands.

use crate::common::{self, again, file, hand, iiwa, recorder, run, session_of, skeleton, taken};
use hwall::glam::DVec3;
use hwall::hand::{Bystanders, HandFrame};
use hwall::haptics::{ArmCommand, Board};
use hwall::kinematics::{ArmKinematics, Chain, ChainArm, JointPositions, JointTorques, SrsArm};
use hwall_record::{
    Ending, Input, Overflow, RecordError, Recorder, RecorderConfig, Request, Run, Skeleton, replay,
};
use hwall_testkit::Sampler;
use std::time::Duration;

#[test]
fn two_runs_come_back_and_run_again_bit_by_bit() {
    let path = file("runs.mcap");
    let mut to = recorder(&path, &RecorderConfig::simulated());
    let commands = [run(&mut to, 0, 3.0), run(&mut to, 1, 0.5)];
    let summary = to.finish().unwrap();
    assert_eq!((summary.dropped, summary.views_dropped), (0, 0));
    assert_eq!(summary.bytes, std::fs::metadata(&path).unwrap().len());
    let recording = taken(&path);
    assert_eq!(recording.ending(), Ending::Finished);
    assert_eq!(recording.setup(), &common::setup());

    let mut seen = [Vec::new(), Vec::new()];
    let (mut number, mut frames, mut worlds, mut requests) = (0, 0, 0, Vec::new());
    for (expected, input) in (0..).zip(recording.inputs()) {
        let (sequence, input) = input.unwrap();
        assert_eq!(sequence, expected);
        match input {
            Input::Run(run) => {
                number = run.number as usize;
                assert_eq!(run.option("who"), Some(&*format!("person {number}")));
            }
            Input::Frame(frame) => {
                // NaN differs from itself, so texts are compared.
                assert_eq!(format!("{frame:?}"), format!("{:?}", hand(frame.t_s)));
                frames += 1;
            }
            Input::World(_) => worlds += 1,
            Input::Request(request) => requests.push(request),
            Input::Cycle(cycle) => seen[number].push(cycle.command),
            Input::End { dropped } => assert_eq!(dropped, 0),
        }
    }
    assert_eq!(seen, commands);
    assert_eq!((frames, worlds), (350, 5));
    assert_eq!(requests[1..3], [Request::Stop, Request::Reset]);
    // The run contained everything that a session does.
    let held = commands[0].iter().filter(|c| **c == ArmCommand::Hold);
    assert!(held.count() > 10);

    let replayed = again(&recording);
    assert_eq!(replayed.difference, None);
    let counts = (replayed.runs, replayed.cycles, replayed.missing);
    assert_eq!(counts, (2, 3500, 0));
}

#[test]
fn another_session_differs_and_the_first_difference_is_named() {
    let path = file("other.mcap");
    common::recorded(&path, 1.5);
    let recording = taken(&path);
    let other = replay(&recording, |setup, _| {
        let mut setup = setup.clone();
        // The door is 0.1 mm further away.
        setup.scene_obj = setup.scene_obj.replace("v 0.6 ", "v 0.6001 ");
        Ok::<_, RecordError>(session_of(&setup))
    });
    let found = other.unwrap().difference.unwrap();
    assert!(found.cycle > 0 && found.cycle < 1400, "{found:?}");
    let text = found.to_string();
    assert!(text.starts_with("run 0, cycle "), "{text}");
    assert!(text.contains("of joint"), "{text}");
}

#[test]
fn a_loop_that_must_not_wait_leaves_out_and_says_so() {
    let path = file("overflow.mcap");
    let config = RecorderConfig {
        overflow: Overflow::Drop,
        capacity: 4,
        ..RecorderConfig::default()
    };
    let mut to = recorder(&path, &config);
    to.begin(Run::default());
    for i in 0..2000 {
        to.frame(&hand(1e-3 * f64::from(i)));
    }
    let dropped = to.dropped();
    assert!(dropped > 1000, "{dropped}");
    let summary = to.finish().unwrap();
    assert_eq!((summary.messages, summary.dropped), (2001, dropped));
    let recording = taken(&path);
    let inputs: Vec<_> = recording.inputs().map(Result::unwrap).collect();
    assert_eq!(inputs.len() as u64, 2001 - dropped + 1);
    assert_eq!(inputs.last().unwrap().1, Input::End { dropped });
}

#[test]
fn recording_does_not_allocate_in_the_loop() {
    let path = file("allocation.mcap");
    let mut to = recorder(&path, &RecorderConfig::default());
    let setup = common::setup();
    let mut session = session_of(&setup);
    to.begin(Run::default());
    let arm = iiwa(&setup.board);
    let mut counted = 0;
    for i in 0..1000 {
        let t_s = 1e-3 * f64::from(i);
        let frame = hand(t_s);
        session.frame(&frame);
        let state = hwall::haptics::ArmState {
            t_s,
            q: JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]),
            qd: Default::default(),
            external_torque: Some(JointTorques::default()),
        };
        let command = session.step(t_s, &state);
        session.plan();
        let cycle = hwall::Cycle {
            t_s,
            state,
            command,
        };
        let events: Vec<_> = std::iter::from_fn(|| session.next_event()).collect();
        let info = allocation_counter::measure(|| {
            to.frame(&frame);
            to.cycle(&cycle);
            to.view(&session, &cycle);
            for event in &events {
                to.event(event);
            }
        });
        counted += info.count_total;
    }
    assert_eq!(counted, 0);
    assert!(arm.joint_count() == 7 && to.finish().is_ok());
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn the_capsule_urdf_is_the_same_arm() {
    let text = skeleton().to_urdf("an <arm>");
    let read = Chain::from_urdf_str(&text, None, None).unwrap();
    let board = Board::default();
    let (drawn, arm) = (ChainArm::new(read).unwrap(), iiwa(&board));
    let mut sampler = Sampler::new(1);
    for _ in 0..100 {
        let q = JointPositions(std::array::from_fn(|_| sampler.uniform(-2.0, 2.0)));
        let far = drawn.forward(&q).distance(&arm.forward(&q));
        assert!(far.position_m < 1e-6 && far.angle_rad < 1e-6, "{far:?}");
    }
    for (a, b) in drawn.limits().iter().zip(Chain::iiwa7().joints()) {
        assert_eq!((a.min_rad, a.max_rad), (b.limit.min_rad, b.limit.max_rad));
    }
}

#[test]
fn links_of_another_arm_are_refused() {
    let board = Board::default();
    let other = SrsArm::iiwa14().with_tool(board.flange_from_board_face().unwrap());
    let error = Skeleton::new(&Chain::iiwa7(), &other, &board).unwrap_err();
    assert!(matches!(error, RecordError::OtherArm { distance_m } if distance_m > 0.01));
}

#[test]
fn a_file_that_cannot_be_written_is_named() {
    let path = file("no").join("folder.mcap");
    let setup = common::setup();
    let scene = common::scene_of(&setup);
    let nominal = RecorderConfig::default();
    let made = Recorder::create(&path, &setup, skeleton(), &scene, &nominal);
    let error = made.unwrap_err().to_string();
    assert!(error.contains("folder.mcap"), "{error}");
    let mut wrong = [nominal.clone(), nominal.clone(), nominal];
    wrong[0].capacity = 0;
    wrong[1].view_period_s = f64::NAN;
    wrong[2].flush_s = f64::INFINITY;
    for config in wrong {
        let made = Recorder::create(&file("config.mcap"), &setup, skeleton(), &scene, &config);
        assert!(matches!(made, Err(RecordError::Argument(_))));
    }
}

/// The machine determines when results of the planner and perception threads arrive, but not what the session does with
/// them.
#[test]
fn a_session_on_three_threads_is_replayed_bit_by_bit() {
    for pause_us in [30, 300] {
        let path = file(&format!("planner-{pause_us}.mcap"));
        let mut to = recorder(&path, &RecorderConfig::simulated());
        let session = session_of(&common::setup());
        let session = session.plan_on_thread().unwrap();
        let session = session.perceive_on_thread().unwrap();
        let pause = Duration::from_micros(pause_us);
        let commands = common::run_of(&mut to, 0, 3.0, session, pause, hand);
        to.finish().unwrap();
        let recording = taken(&path);
        // The arm moved, but not in step with the loop.
        let (mut planned, mut perceived) = (0, 0);
        for input in recording.inputs() {
            match input.unwrap().1 {
                Input::Request(Request::Planned { .. }) => planned += 1,
                Input::Request(Request::Perceived) => perceived += 1,
                _ => {}
            }
        }
        assert!((100..3000).contains(&planned), "{planned}");
        assert!(perceived > 100, "{perceived}");
        let mut positions = commands.iter().filter_map(|command| match command {
            ArmCommand::Position(q) => Some(q),
            _ => None,
        });
        let (first, last) = (positions.next(), positions.next_back());
        let moved_rad = first.unwrap().max_abs_difference(last.unwrap());
        assert!(moved_rad > 0.1, "{moved_rad}");
        assert_eq!(again(&recording).difference, None);
    }
}

/// The commands of a run with these frames, after a replay has given the same.
fn replayed_commands(
    file_name: &str,
    name: &str,
    show: impl Fn(f64) -> HandFrame,
) -> Vec<ArmCommand> {
    let path = file(file_name);
    let mut to = recorder(&path, &RecorderConfig::simulated());
    let session = session_of(&common::setup());
    let commands = common::run_of(&mut to, 0, 1.3, session, Duration::ZERO, show);
    to.finish().unwrap();
    let replayed = again(&taken(&path));
    let outcome = (replayed.difference, replayed.cycles);
    assert_eq!(outcome, (None, 1300), "{name}");
    commands
}

/// What frames say of bystanders, and whether the arm then moves differently than without them.
#[test]
fn recordings_with_bystanders_are_replayed_bit_by_bit() {
    let near_m = DVec3::new(0.7, 0.1, 0.9);
    let [near, far] = [near_m, near_m + DVec3::Y * 3.0].map(Some);
    let told = |heads_m: &[Option<DVec3>]| Some(Bystanders::new(heads_m).unwrap());
    let mut without = None;
    for (name, who, matters) in [
        ("not told", &(|_| None) as &dyn Fn(f64) -> _, false),
        ("nobody", &|_| told(&[]), false),
        ("far", &|_| told(&[far, far, far, far]), false),
        ("near", &|_| told(&[far, near]), true),
        ("unseen", &|_| told(&[None]), true),
        ("no number", &|_| told(&[Some(DVec3::NAN)]), true),
        ("told once", &|t_s| told(&[far]).filter(|_| t_s < 0.4), true),
        (
            "leaves",
            &|t_s| if t_s < 0.4 { told(&[far]) } else { told(&[]) },
            false,
        ),
    ] {
        let commands = replayed_commands("bystanders.mcap", name, |t_s| HandFrame {
            bystanders: who(t_s),
            is_of_another: false,
            ..hand(t_s)
        });
        let without = without.get_or_insert_with(|| commands.clone());
        assert_eq!(*without != commands, matters, "{name}");
    }
}

/// Cases of how the other hand changes, each with whether the arm then moves differently than without another hand.
#[test]
fn recordings_with_another_hand_are_replayed_bit_by_bit() {
    let near_m = DVec3::new(0.57, 0.1, 0.6);
    let mut without = None;
    for (name, other_m, is_of_another, matters) in [
        ("none", &(|_| None) as &dyn Fn(f64) -> _, false, false),
        ("nan", &|_| Some(DVec3::NAN), false, false),
        ("near", &|_| Some(near_m), false, true),
        (
            "comes and goes",
            &|t_s| ((t_s / 0.05) as i64 % 2 == 0).then_some(near_m),
            false,
            true,
        ),
        ("of another", &|_| Some(near_m), true, true),
    ] {
        let commands = replayed_commands("other-hand.mcap", name, |t_s| HandFrame {
            other_hand_m: other_m(t_s),
            is_of_another: is_of_another && (0.795..0.805).contains(&t_s),
            ..hand(t_s)
        });
        let without = without.get_or_insert_with(|| commands.clone());
        assert_eq!(*without != commands, matters, "{name}");
    }
}
