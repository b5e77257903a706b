//! A virtual world that moves, jumps and shakes, and a hand that is lost on a moving board.

use crate::common::{
    TRACKER_S, by_gaze, config, home, iiwa, rough_wall, session_on, shift_world, wall,
};
use hwall::contact::{
    ContactEstimate, ContactEstimator, ContactPrediction, FusedConfig, FusedPredictor,
    PredictionSource, Predictor, PredictorInput,
};
use hwall::geometry::Pose;
use hwall::glam::{DMat3, DVec3};
use hwall::hand::HandFrame;
use hwall::haptics::{ArmCommand, ArmState};
use hwall::kinematics::{ArmKinematics, JointPositions, JointVelocities, Wrench};
use hwall::reachability::{Presented, WallMaps};
use hwall::scene::{Scene, SurfaceId};
use hwall::{EventKind, Session, SessionState, WorldPose, maps_of};

const PLACE_M: DVec3 = DVec3::new(0.6, 0.0, 0.5);

/// Always predicts the same contact, in the frame of the scene; records the hand that it gets.
struct Fixed {
    contact: ContactPrediction,
    velocities: Vec<DVec3>,
}

impl Fixed {
    fn at(point_m: DVec3) -> Self {
        Self {
            contact: ContactPrediction {
                distance_m: 0.3,
                source: PredictionSource::Gaze,
                ..ContactPrediction::of_place(SurfaceId(0), point_m, DVec3::X)
            },
            velocities: Vec::new(),
        }
    }
}

impl Predictor for Fixed {
    fn predict(&mut self, _: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        self.velocities
            .extend(input.hand.map(|hand| hand.velocity_m_per_s));
        std::slice::from_ref(&self.contact)
    }
}

fn session<P: Predictor>(scene: Scene, maps: WallMaps, predictor: P) -> Session<P> {
    session_on(scene, maps, predictor, config())
}

fn frame(t_s: f64, hand_m: DVec3) -> HandFrame {
    HandFrame {
        palm_m: Some(hand_m + DVec3::X * 0.08),
        tips_m: [Some(hand_m); 5],
        head_m: Some(DVec3::new(1.4, 0.0, 0.9)),
        gaze: Some(PLACE_M - DVec3::new(1.4, 0.0, 0.9)),
        ..HandFrame::empty(t_s)
    }
}

/// An ideal arm, under a finger that may press its board.
struct Bench {
    t_s: f64,
    q: JointPositions,
    pressed: bool,
}

impl Bench {
    fn new() -> Self {
        Self {
            t_s: 0.0,
            q: home(),
            pressed: false,
        }
    }

    fn face_m(&self) -> DVec3 {
        iiwa().forward(&self.q).position_m()
    }

    fn step<P: Predictor>(&mut self, session: &mut Session<P>) {
        let arm = iiwa();
        let outward = arm.forward(&self.q).rotation().z_axis;
        let wrench = Wrench {
            force_n: -outward * if self.pressed { 8.0 } else { 0.0 },
            ..Wrench::default()
        };
        let state = ArmState {
            t_s: self.t_s,
            q: self.q,
            qd: JointVelocities::default(),
            external_torque: Some(ArmKinematics::torques_from_wrench(&arm, &self.q, &wrench)),
        };
        if let ArmCommand::Position(q) = session.step(self.t_s, &state) {
            self.q = q;
        }
        session.plan();
        self.t_s += 1e-3;
    }

    /// Frames at the rate of the tracker, steps every millisecond.
    fn run<P: Predictor>(
        &mut self,
        session: &mut Session<P>,
        duration_s: f64,
        frame: impl Fn(f64) -> Option<HandFrame>,
    ) {
        let end_s = self.t_s + duration_s;
        let mut next = (self.t_s / TRACKER_S).ceil();
        while self.t_s < end_s {
            while next * TRACKER_S <= self.t_s {
                frame(next * TRACKER_S)
                    .iter()
                    .for_each(|f| session.frame(f));
                next += 1.0;
            }
            self.step(session);
        }
    }
}

const HAND_M: DVec3 = DVec3::new(0.7, 0.0, 0.5);

fn resting(t_s: f64) -> Option<HandFrame> {
    Some(frame(t_s, HAND_M))
}

fn last_velocity(session: &Session<Fixed>) -> DVec3 {
    let perception = session.perception();
    *perception.predictor().velocities.last().expect("a hand")
}

#[test]
fn a_resting_hand_that_is_steered_along_moves_in_the_world() {
    let mut session = session(wall(0.6), WallMaps::default(), Fixed::at(PLACE_M));
    for k in 0..90 {
        let t_s = f64::from(k) * TRACKER_S;
        // The person is steered at 1 m/s towards smaller x of the world, so the world approaches.
        shift_world(&mut session, t_s, DVec3::X * t_s);
        session.frame(&frame(t_s, HAND_M));
    }
    let last = last_velocity(&session);
    assert!((last - DVec3::NEG_X).length() < 0.02, "{last}");
    // A world at rest carries nobody.
    for k in 120..150 {
        session.frame(&frame(f64::from(k) * TRACKER_S, HAND_M));
    }
    let last = last_velocity(&session);
    assert!(last.length() < 0.02, "{last}");
}

#[test]
fn a_trembling_origin_moves_nothing() {
    let mut session = session(wall(0.6), WallMaps::default(), Fixed::at(PLACE_M));
    let mut bench = Bench::new();
    bench.run(&mut session, 3.0, resting);
    while session.next_event().is_some() {}
    let before = bench.q;
    for k in 0..90 {
        let noise_m = 2e-4 * f64::from(k * 13 % 7 - 3) / 3.0;
        shift_world(&mut session, bench.t_s, DVec3::new(noise_m, 0.0, -noise_m));
        bench.run(&mut session, TRACKER_S, resting);
    }
    assert_eq!(bench.q, before);
    let goals = std::iter::from_fn(|| session.next_event())
        .filter(|event| matches!(event.kind, EventKind::GoalSet(_)));
    assert_eq!(goals.count(), 0);
}

#[test]
fn a_tiny_turn_of_a_world_whose_origin_is_far_away_is_no_motion() {
    let far_m = DVec3::Y * 200.0;
    let turned = |t_s: f64, yaw_rad: f64| WorldPose {
        t_s,
        base_from_world: Pose::from_yaw(yaw_rad, -(DMat3::from_rotation_z(yaw_rad) * far_m))
            .expect("finite"),
    };
    let mut session = session(wall(0.6), WallMaps::default(), Fixed::at(PLACE_M + far_m));
    let mut bench = Bench::new();
    session.world(&turned(0.0, 0.0)).expect("in order");
    bench.run(&mut session, 3.0, resting);
    bench.pressed = true;
    bench.run(&mut session, 0.1, resting);
    assert_eq!(session.state(), SessionState::Touched);
    session.world(&turned(bench.t_s, 5e-6)).expect("in order");
    bench.run(&mut session, 0.05, resting);
    assert_eq!(session.state(), SessionState::Touched);
}

#[test]
fn the_board_goes_to_the_wall_where_it_is_now_not_where_it_was_mapped() {
    let maps = maps_of(&wall(0.6), &iiwa()).expect("maps");
    let out_of_reach_m = DVec3::new(0.6, 1.2, 0.5);
    let mapped = maps.present(out_of_reach_m, DVec3::X);
    assert!(matches!(mapped, Presented::Nearest(_)), "{mapped:?}");
    for off_m in [0.005, 0.012] {
        let mut session = session(wall(0.6), maps.clone(), Fixed::at(out_of_reach_m));
        let by_m = DVec3::X * off_m;
        shift_world(&mut session, 0.0, by_m);
        session.frame(&frame(0.0, HAND_M));
        while let Some(event) = session.next_event() {
            if let EventKind::GoalSet(goal) = event.kind {
                let from_wall_m = (goal.target.point_m - (out_of_reach_m + by_m)).x;
                assert!(from_wall_m.abs() < 1e-9, "{from_wall_m} m off the wall");
            }
        }
    }
}

/// No estimate: the fusion only has gaze and rest.
struct Silent;

impl ContactEstimator for Silent {
    fn begin(&mut self) {}

    fn step(&mut self, _: &HandFrame) -> Option<ContactEstimate> {
        None
    }
}

#[test]
fn after_a_leap_nothing_is_remembered_of_where_the_hand_was() {
    let looking = |t_s: f64| HandFrame {
        tips_m: [Some(DVec3::new(0.5, 0.0, 0.5)); 5],
        head_m: Some(DVec3::new(0.3, 0.0, 0.9)),
        gaze: Some(DVec3::X),
        ..HandFrame::empty(t_s)
    };
    let mut normals = Vec::new();
    for leaps in [false, true] {
        let fused = FusedPredictor::new(Silent, FusedConfig::default()).expect("defaults");
        let mut session = session(wall(0.6), WallMaps::default(), fused);
        if leaps {
            // At first the person stands on the other side of the wall.
            shift_world(&mut session, 0.0, DVec3::X * -0.5);
            for k in 0..45 {
                session.frame(&looking(f64::from(k) * TRACKER_S));
            }
        }
        shift_world(&mut session, 0.5, DVec3::X * 0.05);
        for k in 46..135 {
            session.frame(&looking(f64::from(k) * TRACKER_S));
        }
        normals.push(session.contact().expect("the wall ahead").normal);
    }
    assert_eq!(normals[0], DVec3::NEG_X);
    assert_eq!(normals[1], normals[0], "the board faces the person");
}

#[test]
fn a_hand_that_is_lost_stops_the_board_that_slides_under_it() {
    let (mut moved_m, mut slid_m) = (Vec::new(), Vec::new());
    for silent in [false, true] {
        let mut session = session(rough_wall(0.6, Some(0.5)), WallMaps::default(), by_gaze());
        let mut bench = Bench::new();
        bench.run(&mut session, 2.5, |t_s| {
            Some(frame(t_s, PLACE_M + DVec3::X * 0.01))
        });
        bench.pressed = true;
        let pressing = |t_s| Some(frame(t_s, PLACE_M - DVec3::X * 0.01));
        let from_m = bench.face_m();
        bench.run(&mut session, 0.1, pressing);
        slid_m.push(bench.face_m().distance(from_m));
        // Lost: motion may continue for the allowed age of guidance and the braking after it.
        let lost = |t_s| (!silent).then(|| HandFrame::empty(t_s));
        bench.run(&mut session, 0.4, lost);
        let at_m = bench.face_m();
        bench.run(&mut session, 1.0, lost);
        moved_m.push(bench.face_m().distance(at_m));
        assert_eq!(session.control().safety().name(), "holding");
    }
    assert!(
        slid_m.iter().all(|m| *m > 1e-4),
        "it slid before: {slid_m:?} m"
    );
    assert!(moved_m.iter().all(|m| *m < 1e-9), "{moved_m:?} m");
}
