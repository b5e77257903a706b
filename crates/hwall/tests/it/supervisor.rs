//! The safe states of a session: their names, what the board does in them, and how they end.

use crate::common::{Bench, GazeSession, Hand, by_gaze, config, session, session_with, wall};
use hwall::glam::DVec3;
use hwall::hand::{BodyPoint, Bystanders, HandFrame};
use hwall::haptics::body::BodyRegion;
use hwall::haptics::safety::{Channel, PersonPart};
use hwall::haptics::{ArmCommand, ArmState, HoldReason, SafeReason, SafeState};
use hwall::{EventKind, SessionState};

const TARGET_M: DVec3 = DVec3::new(0.6, 0.0, 0.6);

/// A session in a state, reached by a time, s, before a hand that reaches for a given time, s; past events are dropped.
fn brought_to(state: SessionState, reach_s: f64, until_s: f64) -> (GazeSession, Bench) {
    let hand = Hand::reaching_in(reach_s, TARGET_M);
    let (mut session, mut bench) = (session(wall(0.6)), Bench::new(hand));
    bench.run(&mut session, until_s);
    assert_eq!(session.state(), state);
    while session.next_event().is_some() {}
    (session, bench)
}

/// In place before a slow hand.
fn in_place() -> (GazeSession, Bench) {
    brought_to(SessionState::InPlace, 4.0, 1.6)
}

/// Pressed for 0.3 s.
fn touched() -> (GazeSession, Bench) {
    brought_to(SessionState::Touched, 1.5, 2.3)
}

/// Cycles for a time, s, with a spoiled state; returns the states of the session, without repetition, in order.
fn spoiled(
    session: &mut GazeSession,
    bench: &mut Bench,
    for_s: f64,
    spoil: impl Fn(&mut ArmState),
) -> Vec<&'static str> {
    let until_s = bench.now_s() + for_s;
    let mut names = Vec::new();
    while bench.now_s() < until_s {
        bench.cycle_with(session, &spoil);
        names.push(match session.state() {
            SessionState::Safe(safe) => safe.name(),
            SessionState::Holding(reason) => reason.name(),
            SessionState::Touched => "touched",
            _ => "free",
        });
    }
    names.dedup();
    names
}

/// What the supervisor does, by its name and channel.
fn named(safety: SafeState) -> (&'static str, Option<Channel>) {
    let reason = safety.reason();
    (safety.name(), reason.and_then(|reason| reason.channel()))
}

/// Cycles until a time, s, with changed frames; `after` is called after every cycle.
fn shown(
    session: &mut GazeSession,
    bench: &mut Bench,
    until_s: f64,
    change: impl Fn(&mut HandFrame),
    mut after: impl FnMut(&mut GazeSession, &Bench),
) {
    while bench.now_s() < until_s {
        while let Some(mut frame) = bench.next_frame() {
            change(&mut frame);
            session.frame(&frame);
        }
        bench.step_with(session, |_| {});
        after(session, bench);
    }
}

fn headless(frame: &mut HandFrame) {
    frame.head_m = None;
}

#[test]
fn a_head_that_is_no_longer_seen_makes_the_board_stand_then_withdraw_then_come_back() {
    let (mut session, mut bench) = in_place();
    let from_m = bench.arm.pose().position_m();
    let mut told = Vec::new();
    shown(&mut session, &mut bench, 2.3, headless, |session, _| {
        while let Some(event) = session.next_event() {
            if let EventKind::Safe(safe) = event.kind {
                told.push(named(safe));
            }
        }
    });
    let head = Some(Channel::Head);
    assert_eq!(told, [("holding", head), ("retreating", head)]);
    let way_m = bench.arm.pose().position_m() - from_m;
    assert!((-0.03..-0.005).contains(&way_m.x), "{way_m}");
    assert!(way_m.with_x(0.0).length() < 2e-3, "{way_m}");
    bench.run_for(&mut session, 0.15);
    assert_eq!(session.control().safety(), SafeState::Normal);
    let resumed = std::iter::from_fn(|| session.next_event());
    assert_eq!(resumed.filter(|e| e.kind == EventKind::Resumed).count(), 1);
}

#[test]
fn a_retreat_is_no_faster_than_asked_for_and_ends_behind_the_surface() {
    let (mut session, mut bench) = in_place();
    let from_m = bench.arm.pose().position_m();
    let mut fastest: f64 = 0.0;
    shown(&mut session, &mut bench, 3.4, headless, |_, bench| {
        fastest = fastest.max(bench.arm.twist().linear_m_per_s.length());
    });
    assert!(fastest < 0.11, "{fastest} m/s");
    let way_m = bench.arm.pose().position_m() - from_m;
    assert!((-0.105..-0.08).contains(&way_m.x), "{way_m}");
    assert_eq!(session.control().safety().name(), "retreating");
}

#[test]
fn a_fault_that_the_renderer_has_named_keeps_that_name() {
    let (mut session, mut bench) = in_place();
    let names = spoiled(&mut session, &mut bench, 0.6, |state| {
        state.q[1] = f64::NAN;
    });
    assert_eq!(names, ["non_finite_state"]);
    assert_eq!(session.control().safety().name(), "stopped");
    let events: Vec<_> = std::iter::from_fn(|| session.next_event()).collect();
    let held = |kind: &EventKind| matches!(kind, EventKind::Held(_) | EventKind::Safe(_));
    assert_eq!(events.iter().filter(|e| held(&e.kind)).count(), 1);
    let names = spoiled(&mut session, &mut bench, 0.2, |_| {});
    assert_eq!(names, ["non_finite_state", "free"]);
}

/// Regression: an arm that was pushed at a link during a touch stood still.
#[test]
fn a_push_at_a_link_during_a_touch_is_given_way_to() {
    let (mut session, mut bench) = touched();
    let before = bench.state().external_torque.unwrap_or_default();
    let names = spoiled(&mut session, &mut bench, 1.0, |state| {
        let mut torque = state.external_torque.unwrap_or(before);
        torque[0] += 30.0;
        torque[2] += 15.0;
        state.external_torque = Some(torque);
    });
    assert_eq!(names, ["touched", "holding", "retreating"]);
}

#[test]
fn a_hand_that_presses_too_hard_is_let_go_and_that_is_latched() {
    let (mut session, mut bench) = touched();
    let from_m = bench.arm.pose().position_m();
    // 300 N against the face.
    let push = hwall::geometry::Wrench {
        force_n: bench.arm.pose().rotation().z_axis * -300.0,
        moment_n_m: DVec3::ZERO,
    };
    let jacobian = session.control().arm().jacobian(&bench.arm.q());
    let torque = jacobian.torques(&push);
    let names = spoiled(&mut session, &mut bench, 0.3, |state| {
        state.external_torque = Some(torque);
    });
    assert_eq!(names.last(), Some(&"retreating"), "{names:?}");
    let reason = session.control().safety().reason();
    assert!(matches!(reason, Some(SafeReason::Force { limit_n, .. }) if limit_n == 280.0));
    assert!(bench.arm.pose().position_m().x < from_m.x - 0.01);
    // The fault is gone, but latched.
    spoiled(&mut session, &mut bench, 0.5, |_| {});
    assert!(session.control().is_latched());
    session.reset();
    spoiled(&mut session, &mut bench, 0.3, |_| {});
    assert!(!session.control().is_latched());
    assert_eq!(session.control().safety().name(), "normal");
}

#[test]
fn a_stop_stands_until_it_is_reset() {
    let (mut session, mut bench) = in_place();
    session.stop();
    let state = bench.state();
    assert_eq!(session.step(bench.now_s(), &state), ArmCommand::Hold);
    let reason = SafeReason::Requested;
    assert_eq!(
        session.state(),
        SessionState::Safe(SafeState::Stopped { reason })
    );
    bench.obey(ArmCommand::Hold);
    session.reset();
    bench.run_for(&mut session, 0.2);
    assert_eq!(session.state(), SessionState::InPlace);
}

/// Regression: the head of a person who had left was missing for good.
#[test]
fn whoever_comes_after_somebody_else_begins_anew() {
    let (mut session, mut bench) = in_place();
    let until_s = bench.now_s() + 0.7;
    shown(&mut session, &mut bench, until_s, headless, |_, _| {});
    assert_eq!(session.control().safety().name(), "retreating");
    another(&mut session, &mut bench);
    let until_s = bench.now_s() + 0.5;
    shown(&mut session, &mut bench, until_s, headless, |_, _| {});
    let reason = SafeReason::Unseen(Channel::Head);
    let said = session.control().safety();
    assert_eq!(said, SafeState::Holding { reason });
    bench.run_for(&mut session, 0.15);
    assert_eq!(session.control().safety(), SafeState::Normal);
}

/// The next frame is the first of another person, whose head is not tracked.
fn another(session: &mut GazeSession, bench: &mut Bench) {
    let mut frame = loop {
        if let Some(frame) = bench.next_frame() {
            break frame;
        }
        bench.step_with(session, |_| {});
    };
    (frame.head_m, frame.is_of_another) = (None, true);
    session.frame(&frame);
}

/// If no head is required, a person without one is served after a person with one.
#[test]
fn somebody_without_a_head_is_served_after_somebody_with_one() {
    let mut config = config();
    if let Some(supervisor) = &mut config.supervisor {
        supervisor.required = vec![PersonPart::Fingertip];
    }
    let mut session = session_with(wall(0.6), by_gaze(), config);
    let mut bench = Bench::new(Hand::reaching_in(4.0, TARGET_M));
    bench.run(&mut session, 1.0);
    another(&mut session, &mut bench);
    shown(&mut session, &mut bench, 2.0, headless, |session, bench| {
        let safety = session.control().safety();
        assert!(
            bench.now_s() < 1.2 || safety == SafeState::Normal,
            "{safety}"
        );
    });
}

/// Neither is it work: nothing is allocated.
#[test]
fn waiting_for_a_first_frame_is_no_fault() {
    let hand = Hand::reaching_in(1.5, TARGET_M);
    let (_, mut planner, mut control) = session(wall(0.6)).split();
    let mut bench = Bench::new(hand);
    for k in 0..500 {
        bench.step_apart(&mut control, &mut planner, |_| {});
        assert_eq!(control.state(), SessionState::Holding(HoldReason::NoTarget));
        // The first two states could be wrong; after that nobody is there.
        let reason = match k {
            0..2 => SafeReason::Unproven,
            _ => SafeReason::Unseen(Channel::Head),
        };
        assert_eq!(control.safety(), SafeState::Holding { reason });
    }
}

/// What the frames have of elbow, other hand and head, and how many arms of the person then count: before a touch, and during it, without
/// the touching arm. Without a head the person counts as last seen, but not during a touch.
#[test]
fn elbow_and_other_hand_count_as_long_as_they_are_seen_with_the_head() {
    let beside = Some(TARGET_M + DVec3::new(0.6, 0.3, 0.1));
    let nan = Some(DVec3::NAN);
    for (elbow_m, other_m, sees_head, counted) in [
        (None, None, true, [1, 0]),
        (beside, None, true, [2, 1]),
        (None, beside, true, [2, 1]),
        (beside, beside, true, [3, 2]),
        (nan, beside, true, [2, 1]),
        (beside, nan, true, [2, 1]),
        (beside, beside, false, [1, 0]),
    ] {
        for ((mut session, mut bench), arms) in [in_place(), touched()].into_iter().zip(counted) {
            let seen = |frame: &mut HandFrame| {
                frame.body_m[BodyPoint::Elbow as usize] = elbow_m;
                frame.other_hand_m = other_m;
                frame.head_m = frame.head_m.filter(|_| sees_head);
            };
            let until_s = bench.now_s() + 0.04;
            shown(&mut session, &mut bench, until_s, seen, |_, _| {});
            let supervisor = session.control().supervisor().unwrap();
            let regions = supervisor.person().capsules().map(|(region, _)| region);
            let found = regions.filter(|region| *region == BodyRegion::Arm).count();
            let state = session.state();
            assert_eq!(found, arms, "{elbow_m:?} {other_m:?} {sees_head} {state:?}");
        }
    }
}

/// Cycles for a time, s, with frames that say who stands by, if they do; returns what the supervisor did, by its name and channel, without repetition.
fn with_bystanders(
    session: &mut GazeSession,
    bench: &mut Bench,
    for_s: f64,
    heads_m: Option<&[Option<DVec3>]>,
) -> Vec<(&'static str, Option<Channel>)> {
    let seen = |frame: &mut HandFrame| {
        frame.bystanders = heads_m.map(|heads_m| Bystanders::new(heads_m).unwrap());
    };
    let until_s = bench.now_s() + for_s;
    let mut states = Vec::new();
    shown(session, bench, until_s, seen, |session, _| {
        states.push(named(session.control().safety()));
    });
    states.dedup();
    states
}

fn known_heads(session: &GazeSession) -> usize {
    let capsules = session.control().supervisor().unwrap().person().capsules();
    capsules
        .filter(|(region, _)| *region == BodyRegion::Head)
        .count()
}

#[test]
fn bystanders_are_expected_until_they_are_said_to_have_left() {
    let far = Some(TARGET_M + DVec3::new(2.0, 2.0, 0.5));
    let (normal, lost) = (("normal", None), ("holding", Some(Channel::Bystander)));
    let (mut session, mut bench) = in_place();
    let mut run = |for_s, heads_m: Option<&[Option<DVec3>]>| {
        let states = with_bystanders(&mut session, &mut bench, for_s, heads_m);
        (states, known_heads(&session))
    };
    assert_eq!(run(0.2, Some(&[far, far])), (vec![normal], 3));
    // Not told any more: for 60 ms they count as last seen, with their age, then the arm holds.
    assert_eq!(run(0.04, None), (vec![normal], 3));
    assert_eq!(run(0.1, None), (vec![normal, lost], 3));
    // Told again, it ends by itself.
    assert_eq!(run(0.3, Some(&[far, far])), (vec![lost, normal], 3));
    // One is left out, or not seen, or without a number: the arm does not believe that they have left.
    for heads_m in [&[far] as &[_], &[None, far], &[far, Some(DVec3::NAN)]] {
        let lost_again = (vec![normal, lost], 3);
        assert_eq!(run(0.2, Some(heads_m)), lost_again, "{heads_m:?}");
        assert_eq!(run(0.3, Some(&[far, far])), (vec![lost, normal], 3));
    }
    // They have left, and frames may leave them out from then on.
    assert_eq!(run(0.1, Some(&[])), (vec![normal], 1));
    assert_eq!(run(0.5, None), (vec![normal], 1));
    // Somebody who is there, but was never seen.
    assert_eq!(run(0.1, Some(&[None])), (vec![normal, lost], 1));
    assert_eq!(run(0.3, Some(&[])), (vec![lost, normal], 1));
}

/// Another person with another client: the bystanders of the one before are still there.
#[test]
fn bystanders_outlast_the_person() {
    let far = Some(TARGET_M + DVec3::new(2.0, 2.0, 0.5));
    let (mut session, mut bench) = in_place();
    with_bystanders(&mut session, &mut bench, 0.1, Some(&[far]));
    another(&mut session, &mut bench);
    let states = with_bystanders(&mut session, &mut bench, 0.25, None);
    let lost = ("holding", Some(Channel::Bystander));
    assert_eq!((states.last(), known_heads(&session)), (Some(&lost), 2));
    let states = with_bystanders(&mut session, &mut bench, 0.4, Some(&[]));
    let normal = ("normal", None);
    assert_eq!((states.last(), known_heads(&session)), (Some(&normal), 1));
}

/// The board comes to a hand, unless somebody stands in its way.
#[test]
fn the_board_does_not_come_through_a_bystander() {
    let hand = Hand::reaching_in(4.0, TARGET_M);
    let stands_m = TARGET_M + DVec3::new(0.1, 0.0, 0.1);
    let [nobody, somebody] = [&[] as &[_], &[Some(stands_m)]].map(|heads_m| {
        let (mut session, mut bench) = (session(wall(0.6)), Bench::new(hand));
        with_bystanders(&mut session, &mut bench, 1.6, Some(heads_m));
        let away_m = bench.arm.pose().position_m().distance(TARGET_M);
        (session.state() == SessionState::InPlace, away_m)
    });
    assert!(nobody.0 && !somebody.0, "{nobody:?} {somebody:?}");
    assert!(somebody.1 > nobody.1 + 0.05, "{nobody:?} {somebody:?}");
}
