//! A session led by joint angles: safe whatever they are.

use crate::common::{Bench, DT_S, Hand, config, corners_m, home, iiwa, session_on, wall};
use hwall::contact::{ContactPrediction, Predictor, PredictorInput};
use hwall::glam::{DMat3, DVec3};
use hwall::haptics::HoldReason;
use hwall::kinematics::{ArmKinematics, JointPositions, NearestConfig};
use hwall::scene::{Scene, SurfaceId};
use hwall::{SessionState, Walls};

const WALL_X_M: f64 = 0.75;

/// Always answers with the same joints, with a given error.
struct Fixed {
    q: JointPositions,
    sd_m: f64,
    prediction: [ContactPrediction; 1],
}

impl Fixed {
    fn new(q: JointPositions, place_m: DVec3, sd_m: f64) -> Self {
        let prediction = [ContactPrediction::of_place(SurfaceId(0), place_m, DVec3::X)];
        Self {
            q,
            sd_m,
            prediction,
        }
    }
}

impl Predictor for Fixed {
    fn predict(&mut self, _: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        let prediction = &mut self.prediction[0];
        let Some(hand) = input.hand else { return &[] };
        prediction.distance_m = (hand.point_m - prediction.point_m).x;
        let variance_m2 = DVec3::splat(self.sd_m.powi(2) / 3.0);
        prediction.covariance_m2 = Some(DMat3::from_diagonal(variance_m2));
        &self.prediction
    }

    fn response_rad(&self) -> Option<[f64; 7]> {
        Some(self.q.0)
    }
}

/// The configuration that holds the face at a point with its normal.
fn holding(point_m: DVec3) -> JointPositions {
    let arm = iiwa();
    let pose = hwall::haptics::board_pose(point_m, DVec3::X, 0.0).expect("a pose");
    let config = NearestConfig::default();
    let found = arm.nearest(&pose, &home(), &config, &mut arm.scratch());
    found.expect("within reach").q
}

/// Runs a touch; returns every state of the session, and how far the face came in front of the wall, m.
fn states(q: JointPositions, sd_m: f64) -> (Vec<SessionState>, f64, DVec3) {
    let target_m = DVec3::new(WALL_X_M, 0.0, 0.6);
    let predictor = Fixed::new(q, target_m, sd_m);
    let walls = Walls {
        waiting: Some(home()),
        ..Walls::default()
    };
    let session = session_on(wall(WALL_X_M), walls, predictor, config());
    let (mut perception, mut planner, mut control) = session.split();
    let hand = Hand::reaching_in(2.0, target_m);
    let mut bench = Bench::new(hand);
    let (mut seen, mut most_m) = (Vec::new(), f64::NEG_INFINITY);
    while bench.now_s() < hand.press_s - 0.7 {
        while let Some(frame) = bench.next_frame() {
            perception.frame(&frame);
            while perception.next_event().is_some() {}
        }
        bench.step_apart(&mut control, &mut planner, |_| {});
        while control.next_event().is_some() {}
        seen.push(control.state());
        for corner_m in corners_m(&bench.arm.pose()) {
            most_m = most_m.max(corner_m.x - WALL_X_M);
        }
    }
    assert!(seen.len() as f64 > 1.0 / DT_S);
    let face_m = bench.arm.pose().position_m();
    (seen, most_m, face_m)
}

/// Bound of the follower plus lag of the servo.
const MOST_M: f64 = 0.006;

#[test]
fn the_arm_goes_where_the_joints_say_and_knows_that_it_is_there() {
    for aside_m in [0.0, 0.08] {
        // Away from the expected touch, because surfaces are not used.
        let place_m = DVec3::new(WALL_X_M, aside_m, 0.6);
        let (seen, most_m, face_m) = states(holding(place_m), 0.03);
        assert_eq!(seen.last(), Some(&SessionState::InPlace));
        assert!(face_m.distance(place_m) < 2e-3, "{face_m}");
        assert!(most_m < MOST_M, "{most_m}");
    }
}

#[test]
fn a_board_that_would_come_before_its_surface_is_drawn_back() {
    for before_m in [0.03, 0.1] {
        let place_m = DVec3::new(WALL_X_M + before_m, 0.0, 0.6);
        let (seen, most_m, face_m) = states(holding(place_m), 0.03);
        assert_eq!(seen.last(), Some(&SessionState::InPlace), "{before_m}");
        assert!(most_m < MOST_M, "{most_m}");
        assert!((face_m.x - WALL_X_M).abs() < 3e-3, "{face_m}");
        // A board behind the surface stays there: nothing pulls it to the surface.
        let place_m = DVec3::new(WALL_X_M - before_m, 0.0, 0.6);
        let (.., face_m) = states(holding(place_m), 0.03);
        assert!(face_m.distance(place_m) < 2e-3, "{face_m}");
    }
}

#[test]
fn joints_outside_the_limits_or_not_finite_end_in_a_named_hold() {
    let arm = iiwa();
    for bad_rad in [f64::NAN, f64::INFINITY, arm.limits()[3].max_rad + 0.01] {
        let mut q = holding(DVec3::new(WALL_X_M, 0.0, 0.6));
        q[3] = bad_rad;
        let (seen, most_m, face_m) = states(q, 0.03);
        // Non-finite joints are also a fault for the supervisor.
        let last = seen.last().copied();
        let is_held = match last {
            Some(SessionState::Holding(HoldReason::InvalidTarget)) => true,
            Some(SessionState::Safe(_)) => !bad_rad.is_finite(),
            _ => false,
        };
        assert!(is_held, "{bad_rad}: {last:?}");
        let start_m = arm.forward(&home()).position_m();
        let towards_m = (face_m - start_m).x;
        assert!(most_m < MOST_M && towards_m < 1e-3, "{most_m} {face_m}");
    }
}

#[test]
fn joints_that_are_unsure_leave_the_arm_where_it_waits() {
    for sd_m in [0.3, f64::NAN, f64::INFINITY] {
        let (seen, ..) = states(holding(DVec3::new(WALL_X_M, 0.0, 0.6)), sd_m);
        assert_eq!(seen.last(), Some(&SessionState::Waiting), "{sd_m}");
    }
}
