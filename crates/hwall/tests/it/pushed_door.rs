//! A door that yields to the hand, and one that does not.

use crate::common::{Bench, GazeSession, Hand, by_gaze, config, session_with};
use hwall::glam::DVec3;
use hwall::haptics::{ArmCommand, PlaceTolerance};
use hwall::scene::{Scene, SurfaceId};
use hwall::{MovingSurface, SessionConfig, SessionState};

/// Half a metre from the hinge, which stands at y = -0.3.
const TARGET_M: DVec3 = DVec3::new(0.6, 0.2, 0.6);
const HINGE_M: [f64; 2] = [0.6, -0.3];
const DOOR: SurfaceId = SurfaceId(0);

/// A door in the plane x = 0.6 that turns towards the arm.
fn door(spring_n_m_per_rad: f64) -> Scene {
    let obj = "o door\nv 0.6 -0.3 0\nv 0.6 0.6 0\nv 0.6 0.6 2\nv 0.6 -0.3 2\nf 1 2 3 4\n";
    let sidecar = format!(
        "[surface.door]\nkind = \"revolving_door\"\nhinge_point_m = [{}, {}, 0.0]\nhinge_axis = [0.0, 0.0, 1.0]\n\
         range_deg = [0.0, 60.0]\ninertia_kg_m2 = 0.8\nstiffness_n_m_per_rad = {spring_n_m_per_rad}\n\
         damping_n_m_s_per_rad = 12.0\n",
        HINGE_M[0], HINGE_M[1]
    );
    Scene::from_obj_str(obj, Some(&sidecar)).expect("a door").0
}

fn session(scene: Scene, objects: bool) -> GazeSession {
    let config = SessionConfig {
        objects,
        ..config()
    };
    session_with(scene, by_gaze(), config)
}

fn moving(session: &GazeSession) -> MovingSurface {
    session.control().moving().next().expect("a door")
}

#[test]
fn a_pushed_door_opens_turns_the_board_and_closes() {
    let hand = Hand::reaching_in(1.5, TARGET_M);
    let (mut session, mut bench) = (session(door(30.0), true), Bench::new(hand));
    bench.run(&mut session, hand.press_s - 0.5);
    assert_eq!(moving(&session).position, 0.0);
    let mut most = 0.0_f64;
    let mut touched = 0;
    while bench.now_s() < hand.leave_s {
        bench.cycle(&mut session);
        let door = moving(&session);
        touched += usize::from(door.touched);
        if door.touched && door.position > most {
            most = door.position;
            // The face lies on the door at its current opening.
            let pose = bench.arm.pose();
            let perception = session.perception();
            let closest = perception.scene().project_on(DOOR, pose.position_m());
            let closest = closest.expect("a point");
            // 22 ms of delay at up to 0.2 m/s.
            assert!(closest.distance_m < 5e-3, "{} m", closest.distance_m);
            let cosine = pose.rotation().z_axis.dot(closest.normal);
            let tilt_rad = cosine.abs().min(1.0).acos();
            assert!(tilt_rad < PlaceTolerance::default().tilt_rad, "{tilt_rad}");
        }
        let opening = session.perception().scene().opening(DOOR);
        assert_eq!(opening, Some(door.position));
    }
    assert!(touched > 500, "{touched} ms");
    // At rest 0.5 m * 500 N/m * (15 mm - 0.5 m * angle) = 30 N m/rad * angle: 24 mrad, with little overshoot.
    assert!((0.024..0.032).contains(&most), "{most} rad");
    bench.run(&mut session, hand.end_s + 3.0);
    let door = moving(&session);
    assert!(!door.touched && door.position.abs() < 0.002, "{door:?}");
    assert_ne!(session.state(), SessionState::Touched);
}

#[test]
fn without_objects_a_door_stands_like_a_wall() {
    let hand = Hand::reaching_in(1.5, TARGET_M);
    let (mut session, mut bench) = (session(door(8.0), false), Bench::new(hand));
    bench.run(&mut session, hand.leave_s - 0.2);
    assert_eq!(session.state(), SessionState::Touched);
    assert!(session.control().moving().next().is_none());
    assert_eq!(session.perception().scene().opening(DOOR), Some(0.0));
    let held = bench.arm.pose();
    bench.run(&mut session, hand.leave_s - 0.1);
    assert_eq!(bench.arm.pose(), held);
}

#[test]
fn a_door_that_was_open_is_pushed_further_from_there() {
    let hand = Hand::reaching_in(1.5, TARGET_M);
    let mut scene = door(0.0);
    let opening = 5_f64.to_radians();
    scene.set_opening(DOOR, opening).expect("within its range");
    let (mut session, mut bench) = (session(scene, true), Bench::new(hand));
    assert!((moving(&session).position - opening).abs() < 1e-15);
    bench.run(&mut session, hand.leave_s);
    assert!(moving(&session).position >= opening - 1e-12);
}

#[test]
fn after_a_fault_the_door_goes_on_from_where_the_arm_is() {
    let hand = Hand::reaching_in(1.5, TARGET_M);
    let (mut session, mut bench) = (session(door(30.0), true), Bench::new(hand));
    while !moving(&session).touched || moving(&session).velocity < 0.02 {
        bench.cycle(&mut session);
    }
    // Invalid states while the door swings.
    for _ in 0..300 {
        let command = bench.cycle_with(&mut session, |state| state.q[0] = f64::NAN);
        assert_eq!(command, ArmCommand::Hold);
    }
    assert!(!moving(&session).touched);
    // No command jumps.
    let mut last = bench.arm.q();
    for _ in 0..400 {
        let command = bench.cycle(&mut session);
        if let ArmCommand::Position(q) = command {
            let leap_rad = q.max_abs_difference(&last);
            assert!(leap_rad < 0.01, "{leap_rad} rad at {}", bench.now_s());
            last = q;
        } else {
            last = bench.arm.q();
        }
    }
}
