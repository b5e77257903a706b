//! Invalid scenes, arms, predictions and people: a named state, the board behind the surface, nothing else.

use crate::common::{
    Bench, GazeSession, Hand, TRACKER_S, by_gaze, config, corners_m, home, iiwa, session,
    session_on, wall,
};
use hwall::contact::{ContactPrediction, Predictor, PredictorInput};
use hwall::glam::{DMat3, DVec3};
use hwall::haptics::{Board, HoldReason};
use hwall::scene::{Scene, SurfaceId};
use hwall::{Session, SessionConfig, SessionError, SessionState, Walls, WallsConfig};

/// Position of the wall, m, and how far the board may come in front of it.
const WALL_M: f64 = 0.6;
const IN_FRONT_M: f64 = 0.005;

const TARGET_M: DVec3 = DVec3::new(WALL_M, 0.1, 0.6);

/// Everything that can be computed for a scene, including posture and atlas.
fn walls_of(scene: &Scene) -> Walls {
    let config = WallsConfig::default();
    Walls::of(scene, &iiwa(), &Board::default(), &config).expect("walls")
}

fn led_by_gaze(scene: Scene) -> GazeSession {
    let walls = walls_of(&scene);
    session_on(scene, walls, by_gaze(), config())
}

/// How far the furthest corner of the face is in front of the wall, m.
fn in_front_m(bench: &Bench) -> f64 {
    let corners_m = corners_m(&bench.arm.pose());
    let in_front_m = corners_m.map(|corner_m| corner_m.x - WALL_M);
    in_front_m.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

/// Cycles up to a time, s, each followed by a check. The bench rejects commands outside the limits of the arm.
fn run<P: Predictor>(
    bench: &mut Bench,
    session: &mut Session<P>,
    until_s: f64,
    mut check: impl FnMut(&Bench, &Session<P>),
) {
    while bench.now_s() < until_s {
        bench.cycle(session);
        check(bench, session);
    }
}

/// One touch; the arm stays where it is.
fn stands_at_a_touch_of(scene: Scene, hand: Hand) -> GazeSession {
    let walls = walls_of(&scene);
    assert!(walls.waiting.is_none() && walls.atlas.is_none());
    let (mut session, mut bench) = (led_by_gaze(scene), Bench::new(hand));
    run(&mut bench, &mut session, hand.end_s, |bench, _| {
        let moved_rad = bench.arm.q().max_abs_difference(&home());
        assert!(moved_rad < 1e-3, "{moved_rad} rad at {}", bench.now_s());
    });
    session
}

#[test]
fn an_arm_without_a_wall_within_reach_stays_where_it_is() {
    let floor = "o floor\nv -2 -2 -1\nv 2 -2 -1\nv 2 2 -1\nv -2 2 -1\nf 1 2 3 4\n";
    let (floor, _) = Scene::from_obj_str(floor, None).expect("a floor");
    let session = stands_at_a_touch_of(floor, Hand::reaching_in(1.0, TARGET_M));
    let no_target = SessionState::Holding(HoldReason::NoTarget);
    assert_eq!(session.state(), no_target);
    let far = Hand::reaching_in(1.5, TARGET_M.with_x(2.0));
    let session = stands_at_a_touch_of(wall(2.0), far);
    let refused = session.control().last_step().expect("steps").unreachable;
    assert!(refused.is_some() || session.control().target().is_none());
}

#[test]
fn an_arm_without_a_waiting_posture_serves_the_touch_and_stays_behind_the_wall_after_it() {
    let hand = Hand::reaching_in(1.5, TARGET_M);
    let (mut session, mut bench) = (session(wall(WALL_M)), Bench::new(hand));
    assert!(session.perception().walls().waiting.is_none());
    let (mut touched, until_s) = (false, hand.end_s + 1.0);
    run(&mut bench, &mut session, until_s, |bench, session| {
        touched |= session.state() == SessionState::Touched;
        // The arm starts in front of the wall.
        let in_front_m = in_front_m(bench);
        assert!(!touched || in_front_m < IN_FRONT_M, "{in_front_m} m");
    });
    assert!(touched);
}

/// Predicts another place in every frame.
struct Restless {
    places: Vec<ContactPrediction>,
}

impl Predictor for Restless {
    fn predict(&mut self, _: &Scene, _: &PredictorInput<'_>) -> &[ContactPrediction] {
        self.places.rotate_left(1);
        &self.places[..1]
    }
}

fn place(point_m: DVec3) -> ContactPrediction {
    ContactPrediction {
        covariance_m2: Some(DMat3::from_diagonal(DVec3::splat(1e-4))),
        distance_m: 0.3,
        ..ContactPrediction::of_place(SurfaceId(0), point_m, DVec3::X)
    }
}

/// `strips` narrow upright strips in a row, at one distance.
fn strips(strips: usize) -> Scene {
    let mut obj = String::from("o fence\n");
    for i in 0..strips {
        let y_m = 0.01 * i as f64;
        let end_m = y_m + 0.005;
        for (y_m, z_m) in [(y_m, 0.0), (end_m, 0.0), (end_m, 1.0), (y_m, 1.0)] {
            obj += &format!("v {WALL_M} {y_m} {z_m}\n");
        }
        let first = 4 * i + 1;
        obj += &format!("f {first} {} {} {}\n", first + 1, first + 2, first + 3);
    }
    Scene::from_obj_str(&obj, None).expect("a fence").0
}

/// The board stays behind at most this many pieces: one more is an error, and none is ignored.
#[test]
fn a_scene_of_too_many_upright_pieces_is_named() {
    let of = |count| {
        let scene = strips(count);
        assert_eq!(scene.vertical_facets().len(), count);
        let (board, walls) = (Board::default(), walls_of(&wall(WALL_M)));
        let config = SessionConfig::default();
        Session::new(&iiwa(), &board, scene, walls, by_gaze(), config)
    };
    assert!(of(2048).is_ok());
    let error = of(2049).err().expect("an error");
    let named = SessionError::TooManyUprightPieces {
        count: 2049,
        most: 2048,
    };
    assert_eq!(error, named);
    assert!(error.to_string().contains("2049 upright pieces"), "{error}");
    // Before a minute of work is wasted.
    let config = WallsConfig::default();
    let walls = Walls::of(&strips(2049), &iiwa(), &Board::default(), &config);
    assert_eq!(walls.expect_err("too many pieces"), named);
}

#[test]
fn targets_that_jump_in_every_frame_or_are_nan_move_no_board_out_of_the_wall() {
    let [left, right] = [-0.5, 0.5].map(|y| place(TARGET_M.with_y(y)));
    let nowhere = place(DVec3::NAN);
    let no_direction = ContactPrediction {
        normal: DVec3::NAN,
        ..left
    };
    let walls = walls_of(&wall(WALL_M));
    let waiting = walls.waiting.expect("a posture");
    for places in [
        vec![left, right],
        vec![left, nowhere],
        vec![left, left, left, no_direction],
        vec![nowhere],
    ] {
        let are_bad = places.iter().all(|place| place.point_m.is_nan());
        let predictor = Restless { places };
        let mut session = session_on(wall(WALL_M), walls.clone(), predictor, config());
        let hand = Hand::reaching_in(1.0, TARGET_M);
        let mut bench = Bench::with_arm(std::sync::Arc::new(iiwa()), waiting, hand);
        run(&mut bench, &mut session, 1.4, |bench, session| {
            let in_front_m = in_front_m(bench);
            assert!(in_front_m < IN_FRONT_M, "{in_front_m} m");
            if are_bad && bench.now_s() > 3.0 * TRACKER_S {
                let state = session.state();
                let invalid = SessionState::Holding(HoldReason::InvalidTarget);
                let is_named = state == invalid || matches!(state, SessionState::Safe(_));
                assert!(is_named, "{state:?}");
            }
        });
    }
}

#[test]
fn a_person_inside_the_wall_brings_no_board_out_of_it() {
    // The hand rests between the wall and the arm, and reaches on towards the arm.
    let inside_m = TARGET_M - DVec3::X * 0.1;
    let hand = Hand {
        rest_m: inside_m,
        ..Hand::reaching_in(1.0, inside_m)
    };
    let waiting = walls_of(&wall(WALL_M)).waiting.expect("a posture");
    let mut session = led_by_gaze(wall(WALL_M));
    let mut bench = Bench::with_arm(std::sync::Arc::new(iiwa()), waiting, hand);
    run(&mut bench, &mut session, 2.0, |bench, _| {
        let in_front_m = in_front_m(bench);
        assert!(in_front_m < IN_FRONT_M, "{in_front_m} m");
    });
}
