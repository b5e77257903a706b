//! A hand that comes to a wall, rests on it and leaves: its surface is known throughout.

use crate::common::{self, EYE, ball, fixed, front, gaze_at, side};
use glam::DVec3;
use hwall_contact::{
    ContactEstimate, ContactEstimator, ContactPrediction, FusedConfig, FusedPredictor, Predictor,
    PredictorInput,
};
use hwall_hand::{HandFilter, HandFilterConfig, HandFrame, HandPoint};
use hwall_scene::Scene;
use hwall_testkit::{Sampler, minimum_jerk};

/// Rest, reach, hold, and the motion to the next target, s.
const SPANS_S: [f64; 4] = [0.5, 0.8, 1.0, 0.8];
const PERIOD_S: f64 = 1.0 / 90.0;

/// Start, place where the hand stops and holds, and next target, m.
#[derive(Clone, Copy)]
struct Way {
    start_m: DVec3,
    stop_m: DVec3,
    next_m: DVec3,
}

impl Way {
    fn hand_m(&self, t_s: f64) -> DVec3 {
        let [rest, reach, hold, away] = SPANS_S;
        let share = |begin_s: f64, span_s: f64| minimum_jerk((t_s - begin_s) / span_s);
        let there = self.start_m.lerp(self.stop_m, share(rest, reach));
        there + (self.next_m - self.stop_m) * share(rest + reach + hold, away)
    }
}

fn there_and_back(start_m: DVec3, stop_m: DVec3) -> Way {
    Way {
        start_m,
        stop_m,
        next_m: start_m,
    }
}

/// Knows the target of the hand to 15 mm.
struct Knows(Way);

impl ContactEstimator for Knows {
    fn begin(&mut self) {}

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let leaves_s: f64 = SPANS_S[..3].iter().sum();
        let there = frame.t_s < leaves_s;
        let end_m = if there { self.0.stop_m } else { self.0.next_m };
        Some(ContactEstimate {
            covariance_m2: Some(ball(0.015)),
            ..ContactEstimate::of_point(frame.t_s, end_m)
        })
    }
}

/// All answers with their times; the eyes are on the target, and elsewhere once the hand is there.
fn follow(scene: &Scene, way: Way, look_m: DVec3, seed: u64) -> Vec<(f64, Vec<ContactPrediction>)> {
    let mut predictor = FusedPredictor::new(Knows(way), FusedConfig::default()).unwrap();
    let mut filter = HandFilter::new(HandFilterConfig::simulated()).unwrap();
    let mut sampler = Sampler::new(seed);
    let samples = (SPANS_S.iter().sum::<f64>() / PERIOD_S) as usize;
    (0..samples)
        .map(|i| {
            let t_s = i as f64 * PERIOD_S;
            let mut frame = HandFrame::empty(t_s);
            let noise = sampler.normal_vector() * 7e-4;
            frame.set_point(HandPoint::Index, Some(way.hand_m(t_s) + noise));
            let reaching = t_s < SPANS_S[0] + SPANS_S[1];
            let gaze = gaze_at(EYE, if reaching { way.stop_m } else { look_m });
            let tracking = filter.step(&frame);
            let seen = PredictorInput {
                frame: &frame,
                hand: tracking.state(),
                gaze: fixed(t_s, Some(gaze)),
            };
            (t_s, predictor.predict(scene, &seen).to_vec())
        })
        .collect()
}

/// The hand stays on the named surface while it holds.
fn holds(scene: &Scene, name: &str, way: Way, predictions: &[(f64, Vec<ContactPrediction>)]) {
    let [rest, reach, hold, _] = SPANS_S;
    let there_s = rest + reach;
    let held = |(t_s, _): &&(f64, Vec<_>)| (there_s..there_s + hold).contains(t_s);
    for (t_s, answers) in predictions.iter().filter(held) {
        let p = answers[0];
        assert_eq!(Some(p.surface), scene.find(name), "{t_s} {answers:?}");
        assert_eq!(p.time_to_contact_s.map(|t| t.mean_s), Some(0.0), "{t_s}");
        assert!(p.probability >= 0.9 - 1e-9, "{t_s} {answers:?}");
        assert!(p.point_m.distance(way.stop_m) < 0.016, "{t_s} {p:?}");
        let determinant = p.covariance_m2.unwrap().determinant();
        assert!(determinant < 0.01_f64.powi(6), "{t_s} {p:?}");
    }
}

#[test]
fn a_hand_that_holds_on_a_wall_is_on_it_although_the_eyes_are_elsewhere() {
    let stop_m = DVec3::new(0.7, 0.0, 1.2);
    let way = Way {
        start_m: DVec3::new(0.2, 0.0, 1.2),
        stop_m,
        next_m: DVec3::new(0.2, -0.5, 1.3),
    };
    for (seed, behind_mm) in [-12.0, -6.0, -3.0, 0.0, 3.0, 6.0, 12.0]
        .into_iter()
        .enumerate()
    {
        let x = stop_m.x + 1e-3 * behind_mm;
        let scene = common::plain_scene(&[
            ("wall", front(x, [-0.4, 0.4], [0.6, 1.8])),
            ("picture", front(x - 0.02, [0.1, 0.3], [1.3, 1.5])),
            ("next room", front(x + 0.5, [-1.0, 1.0], [0.3, 2.0])),
            ("post", side(-0.5, [0.0, 0.4], [0.6, 1.8])),
        ]);
        let predictions = follow(&scene, way, DVec3::new(x - 0.02, 0.2, 1.4), seed as u64);
        holds(&scene, "wall", way, &predictions);
        // The prediction follows as soon as the hand leaves at the onset speed of a reach.
        let leaves_s: f64 = SPANS_S[..3].iter().sum();
        let after = |t_s: f64| t_s > leaves_s + 0.17 && t_s < leaves_s + 0.75;
        for (t_s, answers) in predictions.iter().filter(|(t_s, _)| after(*t_s)) {
            let first = Some(answers[0].surface);
            assert_eq!(first, scene.find("post"), "{t_s} {answers:?}");
        }
    }
}

#[test]
fn in_a_corner_the_hand_is_on_the_wall_it_came_towards() {
    let stop_m = DVec3::new(0.7, 0.5, 1.2);
    for (name, start_m) in [
        ("front", DVec3::new(0.2, 0.5, 1.2)),
        ("side", DVec3::new(0.7, 0.0, 1.2)),
    ] {
        for off_m in [-0.004, 0.004, 0.01] {
            // The other wall is 6 mm away, and may be the nearer one.
            let off_m = match name {
                "front" => [off_m, 0.006],
                _ => [0.006, off_m],
            };
            let (x, y) = (stop_m.x + off_m[0], stop_m.y + off_m[1]);
            let quads = [
                ("front", front(x, [-1.0, y], [0.0, 2.0])),
                ("side", side(y, [-0.5, x], [0.0, 2.0])),
            ];
            let scene = common::plain_scene(&quads);
            let way = there_and_back(start_m, stop_m);
            let predictions = follow(&scene, way, DVec3::new(x, 0.0, 0.8), 5);
            holds(&scene, name, way, &predictions);
        }
    }
}

#[test]
fn beside_nothing_a_hand_at_rest_touches_nothing() {
    let scene = common::plain_scene(&[("wall", front(0.76, [-0.4, 0.4], [0.6, 1.8]))]);
    let stop_m = DVec3::new(0.7, 0.0, 1.2);
    let start_m = DVec3::new(0.2, 0.0, 1.2);
    let way = there_and_back(start_m, stop_m);
    let there_s = SPANS_S[0] + SPANS_S[1] + 0.2;
    for (t_s, answers) in follow(&scene, way, DVec3::new(0.76, 0.0, 1.0), 1) {
        if (there_s..there_s + 0.7).contains(&t_s) {
            // Tracker noise is not a motion.
            assert!(answers[0].time_to_contact_s.is_none(), "{t_s} {answers:?}");
            assert!(answers[0].covariance_m2.unwrap().determinant() > 0.01_f64.powi(6));
        }
    }
}
