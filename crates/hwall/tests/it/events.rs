//! What a session reports about one touch.

use crate::common::{Bench, GazeSession, Hand, TRACKER_S, session, wall};
use hwall::glam::DVec3;
use hwall::hand::Tracking;
use hwall::haptics::{HoldReason, SafeReason, SafeState};
use hwall::kinematics::Unreachable;
use hwall::reachability::Presented;
use hwall::scene::SurfaceId;
use hwall::{Event, EventKind, SessionState};

const TARGET_M: DVec3 = DVec3::new(0.6, 0.1, 0.6);

/// All events of a run, in the order of collection after each cycle.
fn events(session: &mut GazeSession, bench: &mut Bench, until_s: f64) -> Vec<Event> {
    let mut events = Vec::new();
    while bench.now_s() < until_s {
        bench.cycle(session);
        events.extend(std::iter::from_fn(|| session.next_event()));
    }
    events
}

const fn name(kind: &EventKind) -> &'static str {
    match kind {
        EventKind::Frame(_) => "frame",
        EventKind::Predicted(_) => "predicted",
        EventKind::GoalSet(_) => "goal",
        EventKind::Arrived => "arrived",
        EventKind::Late => "late",
        EventKind::Unreachable(_) => "unreachable",
        EventKind::Touched { .. } => "touched",
        EventKind::Released => "released",
        EventKind::Held(_) => "held",
        EventKind::Resumed => "resumed",
        EventKind::LinkInFront(_) => "in front",
        EventKind::LinksBehind => "behind",
        _ => "another",
    }
}

/// Names without those of frames; repeated goals of a nearby hand count once.
fn story(events: &[Event]) -> Vec<&'static str> {
    let mut names: Vec<&str> = events.iter().map(|event| name(&event.kind)).collect();
    names.retain(|name| !matches!(*name, "frame" | "predicted"));
    names.dedup();
    names
}

#[test]
fn one_touch_is_told_in_order() {
    let hand = Hand::reaching_in(1.5, TARGET_M);
    let (mut session, mut bench) = (session(wall(0.6)), Bench::new(hand));
    let events = events(&mut session, &mut bench, hand.leave_s + 0.3);
    assert_eq!(
        story(&events),
        [
            "held", "goal", "resumed", "in front", "behind", "arrived", "touched", "released",
            "arrived"
        ]
    );
    // Every frame is followed by its prediction.
    let is_of_frame = |event: &&Event| matches!(name(&event.kind), "frame" | "predicted");
    let of_frames: Vec<&Event> = events.iter().filter(is_of_frame).collect();
    let count = ((hand.leave_s + 0.3) / TRACKER_S).ceil() as usize;
    assert_eq!(of_frames.len(), 2 * count);
    let mut contacts = 0;
    for (i, pair) in of_frames.chunks(2).enumerate() {
        let t_s = i as f64 * TRACKER_S;
        let (EventKind::Frame(tracking), EventKind::Predicted(predicted)) =
            (pair[0].kind, pair[1].kind)
        else {
            panic!("{pair:?}")
        };
        assert_eq!([pair[0].t_s, pair[1].t_s], [t_s; 2]);
        match tracking {
            Tracking::Tracked(state) => assert_eq!(state.t_s, t_s),
            Tracking::Lost { .. } => assert!(predicted.is_none() && i < 10),
        }
        let Some(predicted) = predicted else { continue };
        contacts += 1;
        assert_eq!(predicted.contact.surface, SurfaceId(0));
        assert_eq!(predicted.contact.normal, DVec3::X);
        assert_eq!(predicted.presented, Presented::Reachable);
    }
    assert!(contacts > count - 10);
    for event in &events {
        match event.kind {
            EventKind::GoalSet(goal) => {
                assert_eq!(goal.surface, SurfaceId(0));
                assert!(goal.target.point_m.distance(TARGET_M) < 0.06, "{goal:?}");
                assert_eq!(goal.target.stamp_s, event.t_s);
            }
            EventKind::Touched { normal_force_n } => {
                assert!((3.0..10.0).contains(&normal_force_n));
                let before_s = hand.press_s - event.t_s;
                assert!((0.0..0.4).contains(&before_s), "{before_s} s");
            }
            EventKind::Released => {
                assert!((0.0..0.3).contains(&(event.t_s - hand.leave_s)));
            }
            _ => {}
        }
    }
}

#[test]
fn a_missing_tracker_is_held_and_resumed() {
    let hand = Hand::reaching_in(1.5, TARGET_M);
    let (mut session, mut bench) = (session(wall(0.6)), Bench::new(hand));
    events(&mut session, &mut bench, 0.9);
    for _ in 0..300 {
        bench.step_with(&mut session, |_| {});
    }
    let told: Vec<Event> = std::iter::from_fn(|| session.next_event()).collect();
    // The supervisor reports first, then the renderer.
    let [safe, held] = told[..] else {
        panic!("{told:?}")
    };
    let EventKind::Safe(SafeState::Holding {
        reason: SafeReason::Stale { age_s, .. },
    }) = safe.kind
    else {
        panic!("{safe:?}")
    };
    assert!((0.06..0.07).contains(&age_s), "{age_s} s");
    let EventKind::Held(HoldReason::StaleTarget { age_s }) = held.kind else {
        panic!("{held:?}")
    };
    assert!((0.25..0.26).contains(&age_s), "{age_s} s");
    // The delayed frames come all at once. Inputs must have been sound for 0.1 s.
    let back = events(&mut session, &mut bench, 1.4);
    assert_eq!(story(&back)[0], "resumed");
}

#[test]
fn a_hand_that_is_faster_than_the_arm_makes_it_late_once() {
    let hand = Hand {
        start_s: 0.1,
        press_s: 0.35,
        ..Hand::reaching_in(0.25, DVec3::new(0.6, -0.5, 0.4))
    };
    let (mut session, mut bench) = (session(wall(0.6)), Bench::new(hand));
    let events = events(&mut session, &mut bench, 2.5);
    // Until the hand is gone, the board stays behind the surface, out of the hand's way, and is not late again.
    assert_eq!(
        story(&events),
        [
            "held", "goal", "resumed", "in front", "late", "behind", "arrived"
        ]
    );
    let arrived = events.iter().find(|event| event.kind == EventKind::Arrived);
    assert!(arrived.expect("told").t_s > hand.leave_s);
    let late = events.iter().find(|event| event.kind == EventKind::Late);
    let late_s = late.expect("told").t_s - hand.press_s;
    assert!((-0.3..0.1).contains(&late_s), "{late_s} s");
}

#[test]
fn a_goal_out_of_reach_is_told_once() {
    let hand = Hand::reaching_in(1.5, DVec3::new(2.0, 0.1, 0.6));
    let (mut session, mut bench) = (session(wall(2.0)), Bench::new(hand));
    let events = events(&mut session, &mut bench, 1.0);
    let why = events.iter().filter_map(|event| match event.kind {
        EventKind::Unreachable(why) => Some(why),
        _ => None,
    });
    let why: Vec<Unreachable> = why.collect();
    assert!(matches!(why[..], [Unreachable::TooFar { .. }]), "{why:?}");
    assert_eq!(session.state(), SessionState::Approaching);
}

#[test]
fn events_that_nobody_asks_for_are_counted_and_the_newest_stay() {
    let hand = Hand::reaching_in(1.5, TARGET_M);
    let (mut session, mut bench) = (session(wall(0.6)), Bench::new(hand));
    bench.run(&mut session, 6.0);
    let frames = (6.0 / TRACKER_S).ceil() as u64;
    let mut kept = 0;
    let mut newest_s: f64 = 0.0;
    while let Some(event) = session.perception_mut().next_event() {
        kept += 1;
        newest_s = event.t_s;
    }
    let missed = session.perception().missed_events();
    assert!(missed > 0 && kept + missed >= 2 * frames, "{kept} {missed}");
    assert!(newest_s > 5.95, "{newest_s} s");
    assert_eq!(session.control().missed_events(), 0);
}
