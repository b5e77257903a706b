//! Touches felt by the board are reported to the predictor, with place and time: once per reach, and never during a fault.

use crate::common::{Bench, Hand, by_gaze, config, session_with, wall};
use hwall::contact::{ContactPrediction, DeterministicPredictor, Predictor, PredictorInput};
use hwall::glam::DVec3;
use hwall::hand::Pose;
use hwall::kinematics::JointPositions;
use hwall::scene::Scene;
use hwall::{EventKind, Session, SessionConfig};

/// Predicts by the gaze ray, and records the reported touches.
struct Listening {
    inner: DeterministicPredictor,
    told: Vec<(DVec3, f64)>,
}

impl Predictor for Listening {
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        self.inner.predict(scene, input)
    }

    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        self.told.push((contact_m, contact_s));
    }
}

fn listening(adapts: bool) -> Session<Listening> {
    let config = SessionConfig { adapts, ..config() };
    let (inner, told) = (by_gaze(), Vec::with_capacity(8));
    session_with(wall(0.6), Listening { inner, told }, config)
}

/// Runs one reach for the wall, seen by a tracker with an offset; in cycles of the interval `bad`, s, the state of the arm is NaN. Returns the
/// reported touches, and when the board felt touches, s.
fn run(adapts: bool, bad: std::ops::Range<f64>, off_m: DVec3) -> (Vec<(DVec3, f64)>, Vec<f64>) {
    let hand = Hand::reaching_in(1.5, DVec3::new(0.6, 0.1, 0.6));
    let mut bench = Bench::new(hand);
    let (mut perception, mut planner, mut control) = listening(adapts).split();
    let mut felt = Vec::new();
    let mut warm = false;
    while bench.now_s() < hand.end_s + 0.3 {
        while let Some(frame) = bench.next_frame() {
            let frame = frame.transformed(&Pose::from_translation(off_m).expect("finite"));
            let info = allocation_counter::measure(|| perception.frame(&frame));
            assert!(!warm || info.count_total == 0, "{info:?}");
            warm |= perception.contact().is_some();
        }
        let is_bad = bad.contains(&bench.now_s());
        bench.step_apart(&mut control, &mut planner, |state| {
            if is_bad {
                state.q = JointPositions([f64::NAN; 7]);
            }
        });
        while let Some(event) = control.next_event() {
            if matches!(event.kind, EventKind::Touched { .. }) {
                felt.push(event.t_s);
            }
        }
    }
    (perception.predictor().told.clone(), felt)
}

#[test]
fn the_predictor_is_told_of_a_touch_once_where_and_when_it_was() {
    let (told, felt) = run(true, 0.0..0.0, DVec3::ZERO);
    assert_eq!((told.len(), felt.len()), (1, 1), "{told:?} {felt:?}");
    let (at_m, t_s) = told[0];
    assert_eq!(t_s, felt[0]);
    let hand = Hand::reaching_in(1.5, DVec3::new(0.6, 0.1, 0.6));
    // Between two frames, the hand moves almost on a straight line.
    assert!(at_m.distance(hand.tip_m(t_s)) < 1e-3, "{at_m}");
    assert!(at_m.distance(DVec3::new(0.6, 0.1, 0.6)) < 0.02, "{at_m}");
    // Not told: a session that does not adapt, a press while the tracked hand is far from the wall, and a touch during a fault.
    let (untold, still_felt) = run(false, 0.0..0.0, DVec3::ZERO);
    assert_eq!((untold.len(), still_felt.len()), (0, 1));
    let (untold, _) = run(true, 0.0..0.0, DVec3::X * 0.2);
    assert_eq!(untold, []);
    let (untold, _) = run(true, t_s - 0.2..t_s + 0.5, DVec3::ZERO);
    assert_eq!(untold, []);
}
