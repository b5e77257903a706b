//! Surfaces that the board stays behind, in worlds and rooms that move.

use crate::common::{Bench, GazeSession, Hand, session, shift_world, wall, world_at};
use hwall::geometry::Pose;
use hwall::glam::{DQuat, DVec3};
use hwall::haptics::{ArmCommand, HoldReason};
use hwall::kinematics::JointPositions;
use hwall::scene::Scene;
use hwall::{Control, EventKind, SessionState, WorldPose};
use hwall_testkit::Sampler;

const TARGET_M: DVec3 = DVec3::new(0.6, 0.0, 0.6);

/// A hand that waits for as long as the tests last.
fn resting() -> Hand {
    Hand::reaching_in(1.0, TARGET_M).later(49.5)
}

/// How far the board protrudes in front of the surfaces known to the control half, m.
fn in_front_m(control: &Control) -> f64 {
    control
        .renderer()
        .follower()
        .protrusion_m()
        .expect("a wall")
}

/// A wall that never stops moving is known at its current place, also with split halves.
#[test]
fn barriers_go_with_a_world_that_never_stops() {
    let (mut perception, mut planner, mut control) = session(wall(0.6)).split();
    let mut bench = Bench::new(resting());
    perception
        .world(&world_at(0.0, DVec3::ZERO))
        .expect("in order");
    let mut before_m = None;
    for k in 0..500 {
        // 0.2 m/s towards the arm.
        let by_m = DVec3::NEG_X * 2e-4 * f64::from(k);
        let pose = world_at(bench.now_s(), by_m);
        perception.world(&pose).expect("in order");
        bench.step_apart(&mut control, &mut planner, |_| {});
        // The surfaces are received one step later.
        if k == 0 {
            continue;
        }
        // Tolerates the noise of a tracked origin.
        let now_m = in_front_m(&control);
        let moved_m = now_m - *before_m.get_or_insert(now_m);
        assert!(
            (moved_m - 2e-4 * f64::from(k - 1)).abs() < 1e-3,
            "{k}: {moved_m} m"
        );
    }
}

/// A pose too large for numbers: the board stands still and reports why; it continues once the world is back.
#[test]
fn surfaces_that_nobody_knows_are_told_and_the_board_holds() {
    let mut session = session(wall(0.6));
    let mut bench = Bench::new(Hand::reaching_in(3.0, TARGET_M));
    shift_world(&mut session, 0.0, DVec3::ZERO);
    while session.state() != SessionState::Approaching {
        bench.cycle(&mut session);
        assert!(bench.now_s() < 3.0);
    }
    let told = |session: &mut GazeSession| {
        let kinds = std::iter::from_fn(|| session.next_event()).map(|event| event.kind);
        kinds
            .filter(|kind| *kind == EventKind::SurfacesUnknown)
            .count()
    };
    shift_world(&mut session, bench.now_s(), DVec3::X * 1.5e308);
    for _ in 0..100 {
        bench.cycle(&mut session);
    }
    assert_eq!(told(&mut session), 1);
    let unknown = SessionState::Holding(HoldReason::UnknownSurfaces);
    let holds = [unknown, SessionState::Holding(HoldReason::NoTarget)];
    assert!(holds.contains(&session.state()), "{:?}", session.state());
    let stood = bench.arm.q();
    for _ in 0..300 {
        bench.cycle(&mut session);
    }
    assert!(bench.arm.q().max_abs_difference(&stood) < 0.2);
    shift_world(&mut session, bench.now_s(), DVec3::ZERO);
    bench.run(&mut session, 3.7);
    assert_eq!(session.state(), SessionState::Touched);
    assert_eq!(told(&mut session), 0);
}

/// A scene with a door whose world moves, and whose door is pushed open.
fn door() -> Scene {
    let obj = "o door\nv 0.6 -0.4 0\nv 0.6 0.4 0\nv 0.6 0.4 2\nv 0.6 -0.4 2\nf 1 2 3 4\n\
               o wall\nv 0.6 0.4 0\nv 0.6 1.4 0\nv 0.6 1.4 2\nv 0.6 0.4 2\nf 5 6 7 8\n";
    let sidecar = "[surface.door]\nkind = \"revolving_door\"\nhinge_point_m = [0.6, 0.4, 0.0]\n\
                   hinge_axis = [0.0, 0.0, 1.0]\nrange_deg = [-60.0, 60.0]\n";
    Scene::from_obj_str(obj, Some(sidecar)).expect("a door").0
}

#[test]
fn steps_with_moving_doors_and_worlds_do_not_allocate() {
    let (mut perception, mut planner, mut control) = session(door()).split();
    let id = perception.scene().find("door").expect("it is there");
    let mut bench = Bench::new(resting());
    for k in 0..600 {
        let by_m = DVec3::new(-1e-4, 5e-5, 0.0) * f64::from(k);
        let pose = world_at(bench.now_s(), by_m);
        perception
            .scene_mut()
            .set_opening(id, 1e-3 * f64::from(k))
            .expect("in range");
        let frame = bench.next_frame();
        let _ = perception.world(&pose);
        if let Some(frame) = &frame {
            perception.frame(frame);
        }
        while perception.next_event().is_some() {}
        bench.step_apart(&mut control, &mut planner, |_| {});
    }
}

/// A world whose origin shakes moves its surfaces back and forth; the board still arrives and stands still.
#[test]
fn a_shaking_world_neither_stops_the_board_nor_makes_it_wander() {
    for (shakes_m, hz) in [(0.002, 4.0), (0.005, 7.0), (0.01, 3.0)] {
        let mut session = session(wall(0.6));
        let mut bench = Bench::new(Hand::reaching_in(2.5, TARGET_M));
        let (mut way_m, mut last_m) = (0.0, bench.arm.pose().position_m());
        let start_m = last_m;
        let mut gap_m = 0.0_f64;
        while bench.now_s() < 2.5 {
            let t_s = bench.now_s();
            let by_m = DVec3::X * shakes_m * (std::f64::consts::TAU * hz * t_s).sin();
            shift_world(&mut session, t_s, by_m);
            bench.cycle(&mut session);
            let here_m = bench.arm.pose().position_m();
            way_m += here_m.distance(last_m);
            last_m = here_m;
            if t_s > 1.8 {
                gap_m = gap_m.max((here_m.x - 0.6 - by_m.x).abs());
            }
        }
        let straight_m = start_m.distance(last_m);
        assert!(gap_m < 0.005 + 2.0 * shakes_m, "{hz} Hz: {gap_m} m");
        let shaken_m = 4.0 * shakes_m * hz * 2.5;
        let most_m = 1.5 * (straight_m + shaken_m);
        assert!(way_m < most_m, "{hz} Hz: {way_m} of {most_m} m");
    }
}

/// Worlds that jump, shake, tilt, run away and return, at any time of a touch. Set the number of runs: `HWALL_FAULTED_RUNS=10000 cargo test
/// --release -p hwall --test it moving_barriers::random`.
#[test]
fn random_worlds_end_in_a_named_state_and_no_command_leaps() {
    let runs = std::env::var("HWALL_FAULTED_RUNS").ok();
    let runs: usize = runs.and_then(|runs| runs.parse().ok()).unwrap_or(60);
    let mut sampler = Sampler::new(31);
    let (mut served, mut unknown) = (0, 0);
    for run in 0..runs {
        let hand = Hand::reaching_in(1.5, TARGET_M);
        let (mut session, mut bench) = (session(wall(0.6)), Bench::new(hand));
        let from_s = sampler.uniform(0.0, 2.5);
        let to_s = from_s + sampler.uniform(0.02, 1.0);
        let every_s = [0.001, 0.011, 0.1][sampler.index(3)];
        let size_m = [0.002, 0.02, 0.3, 5.0, 1e6, 1e200, 1.5e308][sampler.index(7)];
        let tilt_rad = [0.0, 0.0, 0.01, 0.3, 3.0][sampler.index(5)];
        let mut due_s = from_s;
        let mut last: Option<JointPositions> = None;
        while bench.now_s() < 4.5 {
            let t_s = bench.now_s();
            let is_at_fault = (from_s..to_s).contains(&t_s);
            if t_s >= due_s && (is_at_fault || due_s < f64::INFINITY) {
                let base_from_world = if is_at_fault {
                    let axis = sampler.unit_vector();
                    let turn = DQuat::from_axis_angle(axis, tilt_rad * sampler.uniform(-1.0, 1.0));
                    Pose::from_quat(turn, sampler.unit_vector() * size_m).expect("a pose")
                } else {
                    due_s = f64::INFINITY;
                    Pose::IDENTITY
                };
                due_s += every_s;
                let _ = session.world(&WorldPose {
                    t_s,
                    base_from_world,
                });
            }
            // The bench refuses commands that are not finite.
            last = match bench.cycle(&mut session) {
                ArmCommand::Position(q) => {
                    let step_rad = last.map_or(0.0, |last| q.max_abs_difference(&last));
                    assert!(step_rad <= 3.2e-3, "run {run}, {t_s} s: {step_rad} rad");
                    Some(q)
                }
                _ => None,
            };
            served += usize::from(session.state() == SessionState::InPlace);
            unknown += std::iter::from_fn(|| session.next_event())
                .filter(|event| event.kind == EventKind::SurfacesUnknown)
                .count();
        }
        // The world is back: the board serves the next fixation, or still stands under the hand.
        let state = session.state();
        use SessionState::{Approaching, InPlace, Late, Waiting};
        let goes_on = matches!(state, InPlace | Approaching | Late | Waiting);
        assert!(
            goes_on,
            "run {run}: {state:?}, {size_m} m, {tilt_rad} rad, {from_s}..{to_s}"
        );
    }
    assert!(served > 0 && unknown > 0);
}

/// The world jumps over the arm and back. The arm starts in front of the wall.
#[test]
fn a_link_before_a_wall_is_told_once_and_so_is_its_end() {
    let mut session = session(wall(0.6));
    let mut bench = Bench::new(Hand::reaching_in(3.0, TARGET_M));
    let mut told = Vec::new();
    for (until_s, x_m) in [(0.5, 0.0), (0.8, -0.3), (1.2, 0.0)] {
        shift_world(&mut session, bench.now_s(), DVec3::X * x_m);
        bench.run(&mut session, until_s);
        while let Some(event) = session.next_event() {
            match event.kind {
                EventKind::LinkInFront(found) => told.push(Some(found.in_front_m > 0.03)),
                EventKind::LinksBehind => told.push(None),
                _ => {}
            }
        }
        assert_eq!(session.control().link_in_front().is_some(), x_m < 0.0);
    }
    assert_eq!(told, [Some(true), None, Some(true), None]);
}
