//! For a person without gaze tracking, places touched before are predicted in addition to the end of the motion.

use crate::common::{ball, gaze_at};
use glam::DVec3;
use hwall_contact::{
    ContactEstimate, ContactEstimator, ContactPrediction, FusedConfig, FusedPredictor,
    PredictionSource, Predictor, PredictorInput,
};
use hwall_hand::{GazeFilter, HandFilter, HandFilterConfig, HandFrame, HandPoint};
use hwall_scene::Scene;

const ROOM: &str = "o wall\nv 0 -2 0\nv 0 0.5 0\nv 0 0.5 3\nv 0 -2 3\nf 1 2 3 4\n\
    o door\nv 0 0.5 0\nv 0 1.5 0\nv 0 1.5 3\nv 0 0.5 3\nf 5 6 7 8\n";
const DOOR: &str = "[surface.door]\nkind = \"revolving_door\"\nhinge_point_m = [0.0, 1.5, 0.0]\n\
    hinge_axis = [0.0, 0.0, 1.0]\nrange_deg = [-90.0, 90.0]\n";
const HOME: DVec3 = DVec3::new(0.6, 0.3, 1.2);
const PLACE: DVec3 = DVec3::new(0.0, 0.9, 1.3);
const PERIOD_S: f64 = 1.0 / 90.0;

/// Gives the same estimate for every motion: an end anywhere around the middle.
#[derive(Debug, Clone)]
struct Vague;

impl ContactEstimator for Vague {
    fn begin(&mut self) {}

    fn begin_tentatively(&mut self) -> bool {
        true
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        Some(ContactEstimate {
            covariance_m2: Some(ball(0.3)),
            ..ContactEstimate::of_point(frame.t_s, DVec3::new(0.0, 0.4, 1.2))
        })
    }
}

struct Person {
    scene: Scene,
    predictor: FusedPredictor<Vague>,
    hand: HandFilter,
    gaze: GazeFilter,
    t_s: f64,
}

impl Person {
    fn new() -> Self {
        Self {
            scene: Scene::from_obj_str(ROOM, Some(DOOR)).expect("a room").0,
            predictor: FusedPredictor::new(Vague, FusedConfig::default()).expect("settings"),
            hand: HandFilter::new(HandFilterConfig::simulated()).expect("settings"),
            gaze: GazeFilter::default(),
            t_s: 0.0,
        }
    }

    fn step(&mut self, point_m: DVec3, looks_at_m: Option<DVec3>) -> Vec<ContactPrediction> {
        self.t_s += PERIOD_S;
        let mut frame = HandFrame::empty(self.t_s);
        frame.set_point(HandPoint::Index, Some(point_m));
        let eye_m = DVec3::new(0.8, 0.3, 1.6);
        let ray = looks_at_m.map(|at_m| gaze_at(eye_m, at_m));
        let tracking = self.hand.step(&frame);
        let input = PredictorInput {
            frame: &frame,
            hand: tracking.state(),
            gaze: self.gaze.step(self.t_s, ray.as_ref()),
        };
        self.predictor.predict(&self.scene, &input).to_vec()
    }

    /// Moves by a share of the way to the place and back, with a pause at either end; returns the predictions half a second after
    /// the start.
    fn reach(&mut self, share: f64, looks_at_m: Option<DVec3>) -> Vec<ContactPrediction> {
        let mut early = Vec::new();
        for k in 0..=220_i32 {
            let there = f64::from(k.clamp(40, 110) - 40) / 70.0;
            let back = f64::from(k.clamp(130, 190) - 130) / 60.0;
            let ease = |tau: f64| tau * tau * (3.0 - 2.0 * tau);
            let point_m = HOME.lerp(PLACE, share * (ease(there) - ease(back)));
            let ranked = self.step(point_m, looks_at_m);
            if k == 85 {
                early = ranked;
            }
        }
        adds_up(&early);
        early
    }

    /// Touches the place four times.
    fn touched() -> Self {
        let mut person = Self::new();
        for _ in 0..4 {
            person.reach(1.0, None);
        }
        person
    }

    /// Predictions at the start of the next reach.
    fn again(&mut self) -> Option<ContactPrediction> {
        repeat(&self.reach(0.5, None)).copied()
    }
}

fn repeat(ranked: &[ContactPrediction]) -> Option<&ContactPrediction> {
    let mut repeats =
        (ranked.iter()).filter(|p| matches!(p.source, PredictionSource::TouchedBefore));
    let first = repeats.next();
    assert!(repeats.next().is_none(), "one place at most");
    first
}

fn adds_up(ranked: &[ContactPrediction]) {
    let sum: f64 = ranked.iter().map(|p| p.probability).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    assert!(ranked.is_sorted_by(|a, b| a.probability >= b.probability));
    let finite = |p: &ContactPrediction| p.point_m.is_finite() && p.normal.is_finite();
    assert!(ranked.iter().all(finite));
}

#[test]
fn who_comes_back_is_expected_at_the_place() {
    let mut person = Person::new();
    assert!(repeat(&person.reach(1.0, None)).is_none());
    for _ in 0..3 {
        person.reach(1.0, None);
    }
    let ranked = person.reach(0.5, None);
    let again = repeat(&ranked).expect("a place");
    assert!(again.probability > 0.4, "{again:?}");
    assert!(again.point_m.distance(PLACE) < 0.1, "{again:?}");
    assert_eq!(person.scene.surface(again.surface).name, "door");
    assert!(again.point_m.x.abs() < 1e-9);
    let other = ranked.iter().find(|p| p.source == PredictionSource::Motion);
    let wide = |p: &ContactPrediction| p.covariance_m2.expect("stated").y_axis.y;
    let (narrow, vague) = (wide(again), wide(other.expect("the motion")));
    let differ = narrow < 0.05 * 0.05 && vague > 10.0 * narrow;
    assert!(differ, "{narrow} {vague}");
}

#[test]
fn a_gaze_says_it_better() {
    let ranked = Person::touched().reach(0.5, Some(DVec3::new(0.0, -0.2, 1.3)));
    assert_ne!(ranked[0].source, PredictionSource::TouchedBefore);
}

#[test]
fn a_place_on_a_door_is_not_named_while_the_door_is_elsewhere() {
    let mut person = Person::touched();
    let door = person.scene.find("door").expect("a door");
    for (opening, named) in [(-0.8, false), (0.0, true)] {
        let moved = person.scene.set_opening(door, opening);
        moved.expect("within its range");
        assert_eq!(person.again().is_some(), named);
    }
}

#[test]
fn it_is_forgotten_with_everything_else() {
    let mut person = Person::touched();
    person.predictor.reset();
    assert_eq!(person.again(), None);
}

#[test]
fn a_lost_hand_and_a_clock_that_is_set_back_end_a_touch_and_no_memory() {
    let mut person = Person::touched();
    for share in [0.3, 0.7, 1.0, 1.0, 1.0] {
        person.step(HOME.lerp(PLACE, share), None);
    }
    person.t_s += 5.0;
    assert!(person.again().is_some());
    person.t_s -= 30.0;
    assert!(person.again().is_some());
}
