//! A virtual world with a frame other than the arm's, and one that moves.

use crate::common::{
    Bench, GazeSession, Hand, iiwa, largest_difference_rad, position, session, session_of,
    shift_world, wall, world_at,
};
use hwall::glam::{DQuat, DVec3};
use hwall::kinematics::{JointPositions, Pose};
use hwall::{EventKind, SessionError, SessionState, WorldPose, maps_of};

const TARGET_M: DVec3 = DVec3::new(0.6, 0.1, 0.6);

fn hand() -> Hand {
    Hand::reaching_in(1.5, TARGET_M)
}

/// Number of such events since the last call.
fn count(session: &mut GazeSession, happened: impl Fn(&EventKind) -> bool) -> usize {
    let kinds = std::iter::from_fn(|| session.next_event()).map(|event| event.kind);
    kinds.filter(happened).count()
}

/// The joints commanded during a whole touch, rad; `None`: the arm is commanded to hold.
fn run(session: &mut GazeSession) -> Vec<Option<JointPositions>> {
    let mut bench = Bench::new(hand());
    let cycles = (0..4000).map(|_| position(bench.cycle(session)));
    cycles.collect()
}

#[test]
fn a_shifted_and_turned_world_is_the_scene_placed_there_by_hand() {
    let turn = DQuat::from_axis_angle(DVec3::new(0.2, -0.3, 0.9).normalize(), 1.1);
    let base_from_world = Pose::from_quat(turn, DVec3::new(-3.0, 12.0, 0.7)).expect("a pose");
    // In its own coordinates, the wall is neither upright nor near the arm.
    let scene = wall(0.6).placed(&base_from_world.inverse());
    let by_hand = scene.placed(&base_from_world);
    let arm = iiwa();
    let maps = maps_of(&by_hand, &arm).expect("maps");

    let mut there = session_of(&arm, scene, maps.clone());
    there
        .world(&WorldPose {
            t_s: 0.0,
            base_from_world,
        })
        .expect("a first stamp");
    let mut here = session_of(&arm, by_hand, maps);
    let (there, here) = (run(&mut there), run(&mut here));
    let worst = largest_difference_rad(&there, &here);
    assert!(worst < 1e-9, "{worst} rad");
    let first = here.iter().flatten().next().expect("commands");
    let last = here.iter().flatten().last().expect("commands");
    assert!(
        first.max_abs_difference(last) > 0.2,
        "the board went somewhere"
    );
}

/// Up to the middle of the touch.
fn touched() -> (GazeSession, Bench) {
    let mut session = session(wall(0.6));
    let mut bench = Bench::new(hand());
    shift_world(&mut session, 0.0, DVec3::ZERO);
    bench.run(&mut session, hand().press_s + 0.2);
    assert_eq!(session.state(), SessionState::Touched);
    count(&mut session, |_| true);
    (session, bench)
}

#[test]
fn a_world_that_moves_during_a_touch_leaves_the_board_still_until_it_is_released() {
    let (mut session, mut bench) = touched();
    let q = bench.arm.q();
    let away = DVec3::new(0.05, 0.2, 0.0);
    shift_world(&mut session, bench.now_s(), away);
    while bench.now_s() < hand().leave_s {
        bench.cycle(&mut session);
        assert_eq!(session.state(), SessionState::TouchedInMovingWorld);
        assert_eq!(bench.arm.q(), q);
    }
    // Moving back does not undo the motion.
    shift_world(&mut session, bench.now_s(), DVec3::ZERO);
    bench.cycle(&mut session);
    assert_eq!(session.state(), SessionState::TouchedInMovingWorld);
    shift_world(&mut session, bench.now_s(), away);
    bench.run(&mut session, hand().end_s);
    let told = |kind: &EventKind| {
        matches!(
            kind,
            EventKind::WorldMovedWhileTouched | EventKind::Released
        )
    };
    assert_eq!(count(&mut session, told), 2);
    bench.run(&mut session, hand().end_s + 2.0);
    assert_eq!(session.state(), SessionState::InPlace);
    let moved_m = bench.arm.pose().position_m().x - (TARGET_M.x + 0.05);
    assert!(moved_m.abs() < 0.005, "{moved_m} m from the wall");
}

/// Regression: after one missed state, the session took the touch for a new one, in a world that had not moved.
#[test]
fn a_bad_state_does_not_let_a_touch_forget_that_the_world_moved() {
    let (mut session, mut bench) = touched();
    shift_world(&mut session, bench.now_s(), DVec3::Y * 0.2);
    bench.cycle(&mut session);
    for _ in 0..5 {
        bench.step_with(&mut session, |state| state.q[0] = f64::NAN);
        assert!(matches!(session.state(), SessionState::Holding(_)));
    }
    // States count again once they have been sound for a while.
    bench.run_for(&mut session, 0.15);
    assert_eq!(session.state(), SessionState::TouchedInMovingWorld);
    let told = |kind: &EventKind| {
        matches!(
            kind,
            EventKind::WorldMovedWhileTouched | EventKind::Touched { .. } | EventKind::Released
        )
    };
    assert_eq!(count(&mut session, told), 1);
}

#[test]
fn less_than_the_noise_of_a_tracked_origin_is_no_motion() {
    let (mut session, mut bench) = touched();
    shift_world(&mut session, bench.now_s(), DVec3::Y * 3e-4);
    bench.cycle(&mut session);
    assert_eq!(session.state(), SessionState::Touched);
}

#[test]
fn stamps_that_run_backwards_are_refused_and_told() {
    let mut session = session(wall(0.6));
    let mut bench = Bench::new(hand());
    bench.run(&mut session, 1.0);
    shift_world(&mut session, 1.0, DVec3::ZERO);
    let contact = session.contact().expect("a contact");
    count(&mut session, |_| true);
    for (stamp_s, by_s) in [(0.75, 0.25), (0.5, 0.25)] {
        let refused = session.world(&world_at(stamp_s, DVec3::Y));
        assert_eq!(refused, Err(SessionError::WorldTimeReversed { by_s }));
    }
    for stamp_s in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let refused = session.world(&world_at(stamp_s, DVec3::Y));
        assert!(
            matches!(refused, Err(SessionError::Argument(_))),
            "{refused:?}"
        );
    }
    assert_eq!(session.contact(), Some(contact));
    let told = |kind: &EventKind| *kind == EventKind::WorldRefused;
    assert_eq!(count(&mut session, told), 5);
}

/// Regression: a single stamp from the future froze the world for good.
#[test]
fn a_clock_that_was_set_back_is_followed_again() {
    let mut session = session(wall(0.6));
    let mut bench = Bench::new(hand());
    bench.run(&mut session, 1.0);
    let before_m = session.contact().expect("a contact").point_m;
    shift_world(&mut session, 1e9, DVec3::ZERO);
    let near = DVec3::X * 0.03;
    session.world(&world_at(1.0, near)).expect_err("older");
    // Newer than the last one.
    shift_world(&mut session, 1.01, near);
    let moved_m = session.contact().expect("a contact").point_m - before_m;
    assert!((moved_m - near).length() < 1e-12, "{moved_m}");
}
