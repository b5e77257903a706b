//! Attacks on the control loop that once succeeded, with their original numbers.

use crate::common::{
    Bench, DT_S, GazeSession, Hand, by_gaze, config, corners_m, iiwa, position, session,
    session_with, wall,
};
use hwall::glam::DVec3;
use hwall::haptics::safety::{Latch, SafeReason};
use hwall::haptics::{ArmCommand, ArmState, ContactState};
use hwall::kinematics::JointPositions;
use hwall::{EventKind, SessionConfig, SessionState, session_supervisor};
use hwall_testkit::Sampler;

const TARGET_M: DVec3 = DVec3::new(0.6, -0.25, 0.7);

fn rig() -> (GazeSession, Bench) {
    let hand = Hand::reaching_in(1.5, TARGET_M);
    (session(wall(0.6)), Bench::new(hand))
}

/// The board is in place long before the hand.
fn in_place() -> (GazeSession, Bench) {
    let hand = Hand::reaching_in(8.0, TARGET_M);
    let (mut session, mut bench) = (session(wall(0.6)), Bench::new(hand));
    sound_cycles(&mut session, &mut bench, 2500);
    (session, bench)
}

/// The board is on its way.
fn approaching() -> (GazeSession, Bench) {
    let (mut session, mut bench) = rig();
    to_the_approach(&mut session, &mut bench);
    (session, bench)
}

/// One cycle with a spoiled state; the arm gets the command. Returns the command, and its distance from the true position, rad.
fn cycle(
    session: &mut GazeSession,
    bench: &mut Bench,
    spoil: impl Fn(&mut ArmState),
) -> (ArmCommand, f64) {
    let mut truly = None;
    let command = bench.cycle_with(session, |state| {
        truly = Some(state.q);
        spoil(state);
    });
    let both = position(command).zip(truly);
    let apart_rad = both.map_or(0.0, |(q, truly)| q.max_abs_difference(&truly));
    (command, apart_rad)
}

/// Sound cycles.
fn sound_cycles(session: &mut GazeSession, bench: &mut Bench, count: usize) {
    for _ in 0..count {
        bench.cycle(session);
    }
}

fn reason(session: &GazeSession) -> Option<SafeReason> {
    session.control().safety().reason()
}

/// Runs until the board is on its way.
fn to_the_approach(session: &mut GazeSession, bench: &mut Bench) {
    while session.state() != SessionState::Approaching {
        bench.cycle(session);
        assert!(bench.now_s() < 3.0);
    }
}

/// Largest distance between commands and a moving arm, rad: 22 ms at full speed, plus the stopping distance of a servo.
const APART_RAD: f64 = 0.3;

#[test]
fn s1_a_wrong_state_at_the_start_is_no_place_to_begin_from() {
    for off_rad in [1000.0, 1.0, -0.4] {
        for cycles in [1, 2, 50] {
            let (mut session, mut bench) = rig();
            let mut held = 0;
            // Frames first, so that there is a goal from the first cycle on.
            while bench.now_s() < 0.1 {
                bench.show_frames(&mut session);
                bench.obey(ArmCommand::Hold);
            }
            for k in 0..400 {
                let (command, apart_rad) = cycle(&mut session, &mut bench, |state| {
                    if k < cycles {
                        // A single reading, unrelated to the next.
                        state.q[1] += off_rad * (1.0 + f64::from(k));
                    }
                });
                let most_rad = if k < 20 + cycles { 0.01 } else { APART_RAD };
                assert!(apart_rad < most_rad, "{off_rad} {k}: {apart_rad} rad");
                held += u32::from(command == ArmCommand::Hold && reason(&session).is_some());
            }
            assert!(held >= cycles, "{off_rad} rad: held {held} of {cycles}");
        }
    }
}

#[test]
fn s1_a_wrong_state_after_a_hold_is_none_either() {
    for off_rad in [1000.0, 1.0] {
        let (mut session, mut bench) = approaching();
        for _ in 0..300 {
            cycle(&mut session, &mut bench, |state| state.q[0] = f64::NAN);
        }
        // Every cycle of the return gets the wrong state once.
        for wrong in [0, 1, 50, 99, 100, 101, 102] {
            for k in 0..400 {
                let (_, apart_rad) = cycle(&mut session, &mut bench, |state| {
                    if k == wrong {
                        state.q[1] += off_rad;
                    }
                });
                assert!(apart_rad < APART_RAD, "{off_rad} {wrong}: {apart_rad} rad");
            }
            session.reset();
        }
    }
}

#[test]
fn s1_an_angle_that_stays_where_it_leapt_to_is_not_believed() {
    // Allowed error of such a joint while the arm still brakes.
    const BRAKES_RAD: f64 = 0.15;
    for (joint, off_rad) in [(0, 0.1), (1, -0.25), (3, 0.29), (5, -0.1)] {
        let (mut session, mut bench) = in_place();
        for _ in 0..1000 {
            let spoil = |state: &mut ArmState| state.q[joint] += off_rad;
            let (_, apart_rad) = cycle(&mut session, &mut bench, spoil);
            assert!(apart_rad < BRAKES_RAD, "joint {joint}: {apart_rad} rad");
        }
        let reason = reason(&session);
        assert!(
            matches!(reason, Some(SafeReason::Jump { by, .. }) if (by - off_rad.abs()).abs() < 0.06),
            "joint {joint}: {reason:?}"
        );
        assert!(session.control().is_latched());
        sound_cycles(&mut session, &mut bench, 400);
        session.reset();
        sound_cycles(&mut session, &mut bench, 400);
        assert!(!session.control().is_latched());
    }
}

#[test]
fn s1_a_velocity_that_is_none_lets_no_leap_of_an_angle_through() {
    for velocity in [f64::NAN, f64::INFINITY, 1e6, -1e6] {
        let (mut session, mut bench) = in_place();
        cycle(&mut session, &mut bench, |state| state.qd[0] = velocity);
        for _ in 0..1000 {
            let (_, apart_rad) = cycle(&mut session, &mut bench, |state| state.q[0] += 0.25);
            assert!(apart_rad < 0.15, "{velocity}: {apart_rad} rad");
        }
        assert!(session.control().is_latched(), "{velocity}");
    }
}

#[test]
fn s2_an_arm_that_does_not_move_for_three_seconds_is_noticed_and_does_not_leap() {
    for noise in [0.0, 1e-9] {
        let (mut session, mut bench) = approaching();
        let (mut held, mut most_rad, mut last) = (0, 0.0_f64, None);
        let stood = bench.arm.q();
        // Its drives are off: it stands still and reports this.
        for k in 0..3000 {
            let mut state = bench.state();
            (state.q, state.qd) = (stood, Default::default());
            tremble(&mut state, noise, k);
            bench.show_frames(&mut session);
            last = position(session.step(bench.now_s(), &state));
            match &last {
                Some(q) => most_rad = most_rad.max(q.max_abs_difference(&stood)),
                None => held += 1,
            }
            session.plan();
            bench.obey(ArmCommand::Hold);
        }
        // It was 3.3 rad; at 2 rad/s, detection takes a quarter of a second.
        assert!(most_rad < 0.8 && held > 1000, "{most_rad} rad, held {held}");
        // Without any noise its state may count as frozen first.
        assert!(noise == 0.0 || not_obeyed(&mut session) == 1);
        goes_on_after_a_reset(&mut session, &mut bench, last);
    }
}

/// Noise of one joint, without which a state that stays the same counts as frozen.
fn tremble(state: &mut ArmState, noise: f64, cycle: u32) {
    state.q[6] += noise * f64::from(cycle % 7);
    state.qd[6] += noise * f64::from(cycle % 7);
}

/// How often it was told that the arm does not obey.
fn not_obeyed(session: &mut GazeSession) -> usize {
    let events = std::iter::from_fn(|| session.next_event());
    let named = Some(SafeReason::NotObeyed);
    let told = |kind| matches!(kind, EventKind::Safe(safe) if safe.reason() == named);
    events.filter(|event| told(event.kind)).count()
}

/// The arm obeys again: no command leaps, no joint is too fast, and the board is brought in place.
fn goes_on_after_a_reset(
    session: &mut GazeSession,
    bench: &mut Bench,
    mut last: Option<JointPositions>,
) {
    session.reset();
    bench.hand = Hand::reaching_in(1.5, TARGET_M).later(bench.now_s());
    let mut served = false;
    for _ in 0..3000 {
        let command = bench.cycle(session);
        served |= session.state() == SessionState::InPlace;
        last = position(command).inspect(|q| {
            let (from, most) = last.map_or((bench.arm.q(), 0.06), |last| (last, 3.2 * DT_S));
            assert!(q.max_abs_difference(&from) <= most);
        });
        let (qd, limits) = (bench.arm.qd(), *iiwa().max_velocity_rad_per_s());
        assert!((0..7).all(|i| qd[i].abs() < 1.05 * limits[i]), "{qd:?}");
    }
    assert!(served && !session.control().is_latched());
}

#[test]
fn an_arm_that_drifts_although_it_was_told_to_hold_is_named() {
    let (mut session, mut bench) = rig();
    sound_cycles(&mut session, &mut bench, 500);
    session.stop();
    let (held, began_s) = (bench.arm.q(), bench.now_s());
    while reason(&session) != Some(SafeReason::NotObeyed) {
        let drifts_s = bench.now_s() - began_s;
        assert!(drifts_s < 1.5);
        bench.show_frames(&mut session);
        session.step(bench.now_s(), &bench.state());
        session.plan();
        let mut q = held;
        q[0] += 0.15 * drifts_s;
        bench.send(ArmCommand::Position(q));
    }
    assert!(session.control().is_latched());
    sound_cycles(&mut session, &mut bench, 500);
    goes_on_after_a_reset(&mut session, &mut bench, None);
}

#[test]
fn s4_after_a_stall_the_first_command_is_no_leap() {
    for stall_s in [0.01, 0.05, 0.19, 3.0] {
        let (mut session, mut bench) = approaching();
        // Until it moves fast.
        while bench.arm.twist().linear_m_per_s.length() < 0.5 {
            bench.cycle(&mut session);
        }
        let ArmCommand::Position(last) = bench.cycle(&mut session) else {
            panic!("not on its way");
        };
        bench.arm.advance(stall_s).unwrap();
        let mut state = bench.state();
        // An arm without commands stands still where it was commanded; the loop continues from its last command.
        state.t_s = bench.now_s() + stall_s;
        if let ArmCommand::Position(q) = session.step(state.t_s, &state) {
            // It was 0.108 rad; four nominal steps at full speed are 0.013.
            let first_rad = q.max_abs_difference(&last);
            assert!(first_rad < 0.014, "{stall_s} s: {first_rad} rad");
        }
    }
}

#[test]
fn s5_torques_that_no_sensor_says_are_no_touch() {
    for torque_n_m in [-1e100, 1e100, 1e9, 400.0, f64::MAX] {
        let (mut session, mut bench) = approaching();
        for _ in 0..200 {
            let (command, _) = cycle(&mut session, &mut bench, |state| {
                if let Some(torque) = &mut state.external_torque {
                    torque[1] += torque_n_m;
                }
            });
            assert_eq!(command, ArmCommand::Hold);
            let contact = session.control().renderer().contact();
            assert_eq!(contact, ContactState::NonContact);
        }
        assert!(reason(&session).is_some(), "{torque_n_m}");
    }
}

#[test]
fn s5_a_bias_of_the_torque_sensors_is_found_at_rest_and_named() {
    for (bias_n_m, is_named) in [(20.0, true), (-20.0, true), (3.0, false), (0.0, false)] {
        // A person who waits for a while: the board is in place and at rest before.
        let hand = Hand::reaching_in(1.5, TARGET_M).later(2.0);
        let (mut session, mut bench) = (session(wall(0.6)), Bench::new(hand));
        let biased = |state: &mut ArmState| {
            if let Some(torque) = &mut state.external_torque {
                torque[1] += bias_n_m;
            }
        };
        let mut named = None;
        for _ in 0..2500 {
            cycle(&mut session, &mut bench, biased);
            if let Some(SafeReason::TorqueBias { joint, bias_n_m }) = reason(&session) {
                named = named.or(Some((joint, bias_n_m)));
            }
        }
        assert_eq!(named.is_some(), is_named, "{bias_n_m} N m");
        if let Some((joint, found_n_m)) = named {
            assert!(joint == 1 && (found_n_m - bias_n_m).abs() < 0.1 * bias_n_m.abs());
            let command = session.step(bench.now_s(), &bench.state());
            assert_eq!(command, ArmCommand::Hold);
        }
    }
}

#[test]
fn s6_no_corner_comes_near_a_hand_faster_than_it_can_stop() {
    for (k, y) in [-0.3, -0.1, 0.1, 0.3].into_iter().enumerate() {
        for reach_s in [0.6, 1.0, 1.5] {
            let target_m = DVec3::new(0.6, y, 0.5 + 0.08 * k as f64);
            let mut session = session(wall(0.6));
            let mut bench = Bench::new(Hand::reaching_in(reach_s, target_m));
            while bench.now_s() < bench.hand.press_s {
                bench.cycle(&mut session);
                let (pose, twist) = (bench.arm.pose(), bench.arm.twist());
                let tip_m = bench.hand.tip_m(bench.now_s());
                for corner_m in corners_m(&pose) {
                    let lever_m = corner_m - pose.position_m();
                    let velocity = twist.linear_m_per_s + twist.angular_rad_per_s.cross(lever_m);
                    let speed = velocity.length();
                    assert!(speed < 3.0, "{speed} m/s");
                    let way = tip_m - corner_m;
                    if way.length() < 0.25 {
                        let closing = velocity.dot(way.normalize());
                        // 5 m/s² to a stop at 2 cm, at least 0.25 m/s.
                        let allowed = (10.0 * (way.length() - 0.02).max(0.0)).sqrt().max(0.25);
                        let over = closing - allowed;
                        assert!(over < 0.1, "{over} m/s above what is allowed");
                    }
                }
            }
        }
    }
}

#[test]
fn lost_commands_are_noticed_before_the_arm_is_far_off() {
    for lost_of_ten in [5, 9, 10] {
        let (mut session, mut bench) = approaching();
        for k in 0..2000 {
            bench.show_frames(&mut session);
            let mut state = bench.state();
            tremble(&mut state, 1e-9, k);
            let command = session.step(bench.now_s(), &state);
            session.plan();
            let apart_rad = position(command).map_or(0.0, |q| q.max_abs_difference(&state.q));
            assert!(apart_rad < 0.75, "{lost_of_ten}: {apart_rad} rad");
            // After a lost command, the last one stays in force.
            if k % 10 < lost_of_ten {
                bench.arm.advance(DT_S).unwrap();
                bench.skip();
            } else {
                bench.obey(command);
            }
        }
        if lost_of_ten == 10 {
            assert_eq!(reason(&session), Some(SafeReason::NotObeyed));
        }
    }
}

#[test]
fn what_ends_by_itself_and_what_needs_a_person_is_a_setting() {
    let beyond = iiwa().limits()[5].max_rad + 0.05;
    let dropout = |state: &mut ArmState| state.q[0] = f64::NAN;
    let too_far = |state: &mut ArmState| state.q[5] = beyond;
    assert_eq!(session_supervisor().latch, Latch::Serious);
    for (latch, after_dropout, after_limit) in [
        (Latch::Nothing, false, false),
        (Latch::Serious, false, true),
        (Latch::Everything, true, true),
    ] {
        for (fault, latched) in [
            (&dropout as &dyn Fn(&mut ArmState), after_dropout),
            (&too_far, after_limit),
        ] {
            let mut supervisor = session_supervisor();
            supervisor.latch = latch;
            let config = SessionConfig {
                supervisor: Some(supervisor),
                ..config()
            };
            let mut session = session_with(wall(0.6), by_gaze(), config);
            let mut bench = Bench::new(Hand::reaching_in(1.5, TARGET_M));
            to_the_approach(&mut session, &mut bench);
            for _ in 0..50 {
                cycle(&mut session, &mut bench, fault);
            }
            sound_cycles(&mut session, &mut bench, 400);
            assert_eq!(session.control().is_latched(), latched, "{latch:?}");
            session.reset();
            sound_cycles(&mut session, &mut bench, 400);
            assert!(!session.control().is_latched(), "{latch:?}");
            // It continues, if slowly.
            use SafeReason::{CommandLimit, PersonNear};
            let slowed = reason(&session);
            let goes_on = matches!(slowed, None | Some(PersonNear { .. } | CommandLimit { .. }));
            assert!(goes_on, "{slowed:?}");
            // A requested stop needs a person, whatever the setting.
            session.stop();
            sound_cycles(&mut session, &mut bench, 400);
            assert!(session.control().is_latched(), "{latch:?}");
        }
    }
}

/// Spoils one number of a state.
fn spoiled(state: &mut ArmState, channel: usize, joint: usize, by: f64, replaces: bool) {
    let number = match (channel, &mut state.external_torque) {
        (0, _) => &mut state.q.0[joint],
        (1, _) => &mut state.qd.0[joint],
        (2, Some(torque)) => &mut torque.0[joint],
        _ => &mut state.t_s,
    };
    *number = if replaces { by } else { *number + by };
}

/// Sizes of faults.
const SIZES: [f64; 10] = [
    f64::NAN,
    f64::INFINITY,
    -1e300,
    1000.0,
    20.0,
    1.0,
    -0.3,
    0.05,
    -1e-3,
    0.0,
];

/// Set the number of runs: `HWALL_FAULTED_RUNS=100000 cargo test --release -p hwall --test it loop_attacks::random`.
#[test]
fn random_faults_end_in_a_named_state_and_no_command_leaps() {
    let runs = std::env::var("HWALL_FAULTED_RUNS").ok();
    let runs: usize = runs.and_then(|runs| runs.parse().ok()).unwrap_or(300);
    let mut sampler = Sampler::new(29);
    let (mut session, mut bench) = rig();
    let mut named = 0;
    for run in 0..runs {
        if bench.now_s() > bench.hand.end_s {
            // The next touch, elsewhere.
            let off_m = DVec3::new(0.0, sampler.uniform(0.0, 0.5), sampler.uniform(-0.2, 0.1));
            bench.hand = Hand::reaching_in(1.0, TARGET_M + off_m).later(bench.now_s());
        }
        let (channel, joint) = (sampler.index(4), sampler.index(7));
        let by = SIZES[sampler.index(SIZES.len())] * [1.0, -1.0][sampler.index(2)];
        let replaces = sampler.index(4) == 0;
        let cycles = [1, 3, 20, 150][sampler.index(4)];
        let fault = format!("run {run}: channel {channel}, joint {joint}, {by}, {cycles} cycles");
        let (mut was_named, mut last) = (false, None::<JointPositions>);
        for k in 0..cycles + 350 {
            let (command, apart_rad) = cycle(&mut session, &mut bench, |state| {
                if k < cycles {
                    spoiled(state, channel, joint, by, replaces);
                }
            });
            was_named |= command == ArmCommand::Hold;
            assert!(apart_rad < 0.5, "{fault}, {k}: {apart_rad} rad off the arm");
            let now = position(command);
            let step_rad = now.zip(last).map_or(0.0, |(q, p)| q.max_abs_difference(&p));
            assert!(
                step_rad <= 3.2 * DT_S,
                "{fault}, {k}: leaps by {step_rad} rad"
            );
            last = now;
        }
        named += usize::from(was_named);
        session.reset();
        sound_cycles(&mut session, &mut bench, 150);
        let state = session.state();
        assert!(!session.control().is_latched(), "{fault}: {state:?}");
    }
    assert!(named > runs / 3);
}
