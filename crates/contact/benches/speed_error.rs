//! Time per sample and error: `cargo bench -p hwall-contact --bench speed_error`.
//!
//! Estimators of the end of a reach, and the learned one fused with a wall and gaze. Training and test people are different.

mod reaches;

use glam::DVec3;
use hwall_contact::{
    Combination, ConstantVelocity, ContactError, ContactEstimator, FusedConfig, FusedPredictor,
    Hold, LearnedConfig, LearnedModel, MinimumJerk, NearestNeighbour, Predictor, PredictorInput,
    RidgeWindow,
};
use hwall_hand::{Fixation, Gaze, GazeRay, HandFilter, HandFilterConfig, LabelledReach};
use hwall_scene::Scene;
use hwall_testkit::{ErrorStats, Machine, SpeedErrorTable, Timing, format_ns};
use reaches::reaches;
use std::time::Instant;

const SEED: u64 = 7;
/// Number of people and reaches for training, as in the dissertation, and for testing.
const TRAIN: (usize, usize) = (6, 47);
const TEST: (usize, usize) = (8, 160);
/// Shares of the samples of a reach at which it is evaluated.
const SHARES: [f64; 3] = [0.5, 0.7, 0.9];

/// The wall where the reaches end, and a smaller one in front of it.
const SCENE: &str = "o wall\nv 0 -1 -1\nv 0 1 -1\nv 0 1 1\nv 0 -1 1\nf 1 2 3 4\n\
                     o shelf\nv 0.2 -0.9 -0.4\nv 0.2 -0.5 -0.4\nv 0.2 -0.5 0\nv 0.2 -0.9 0\nf 5 6 7 8\n";

/// Follows all reaches; `step` returns the predicted end, m.
fn follow(
    table: &mut SpeedErrorTable,
    (method, setting, note): (&str, &str, String),
    test: &[LabelledReach],
    mut step: impl FnMut(&LabelledReach, usize) -> (Option<DVec3>, f64),
) {
    let mut times_ns = Vec::new();
    let mut errors_m = SHARES.map(|_| Vec::new());
    for reach in test {
        let last = (reach.frames.len() - 1) as f64;
        let judged = SHARES.map(|share| (share * last) as usize);
        for k in 0..reach.frames.len() {
            let (end_m, ns) = step(reach, k);
            times_ns.push(ns);
            for (errors_m, _) in errors_m.iter_mut().zip(judged).filter(|(_, at)| *at == k) {
                errors_m.extend(end_m.map(|end_m| end_m.distance(reach.contact_m)));
            }
        }
    }
    let timing = Timing::from_samples_ns(times_ns);
    for (share, errors_m) in SHARES.into_iter().zip(errors_m) {
        table.row(
            method,
            format!("{setting}{:.0} %", 100.0 * share),
            timing,
            (ErrorStats::from_errors(errors_m), "m"),
            note.as_str(),
        );
    }
}

fn timed<T>(f: impl FnOnce() -> T) -> (T, f64) {
    let began = Instant::now();
    let value = f();
    (value, began.elapsed().as_secs_f64() * 1e9)
}

fn estimator<E: ContactEstimator>(
    table: &mut SpeedErrorTable,
    method: &str,
    train: impl Fn(&[LabelledReach]) -> Result<E, ContactError>,
) {
    let demonstrations = reaches(SEED, TRAIN.0, TRAIN.1);
    let (trained, train_ns) = timed(|| train(&demonstrations));
    let mut trained = trained.expect("good reaches");
    let note = format!("trained in {}", format_ns(train_ns));
    let test = reaches(SEED + 1, TEST.0, TEST.1);
    follow(table, (method, "", note), &test, |reach, k| {
        if k == 0 {
            trained.begin();
        }
        let (estimate, ns) = timed(|| trained.step(&reach.frames[k]));
        (estimate.map(|e| e.point_m), ns)
    });
}

fn learned(
    demonstrations: &[LabelledReach],
    combination: Combination,
) -> Result<LearnedModel, ContactError> {
    let config = LearnedConfig {
        combination,
        ..LearnedConfig::default()
    };
    LearnedModel::train(demonstrations, &config)
}

/// The learned estimator behind the filter of the hand, fused with the wall; the eyes look at the target.
fn fused(table: &mut SpeedErrorTable, rays: usize) {
    let (scene, _) = Scene::from_obj_str(SCENE, None).expect("a scene");
    let demonstrations = reaches(SEED, TRAIN.0, TRAIN.1);
    let model = learned(&demonstrations, Combination::Both).expect("good reaches");
    let test = reaches(SEED + 1, TEST.0, TEST.1);
    let config = FusedConfig {
        rays,
        ..FusedConfig::default()
    };
    let fresh = FusedPredictor::new(model.estimator(), config).expect("good settings");
    let mut state = None;
    let (setting, note) = (format!("{rays} rays, "), "estimator included".to_owned());
    follow(table, ("fused", &setting, note), &test, |reach, k| {
        if k == 0 {
            let filter = HandFilter::new(HandFilterConfig::default()).expect("good settings");
            state = Some((fresh.clone(), filter));
        }
        let Some((predictor, filter)) = &mut state else {
            return (None, 0.0);
        };
        let frame = &reach.frames[k];
        let tracking = filter.step(frame);
        let gaze = frame.head_m.map(|origin_m| GazeRay {
            origin_m,
            direction: (reach.contact_m - origin_m).normalize(),
        });
        let seen = PredictorInput {
            frame,
            hand: tracking.state(),
            gaze: gaze.map_or(Gaze::Lost, |ray| {
                Gaze::Fixed(Fixation::of_ray(reach.frames[0].t_s, frame.t_s, ray))
            }),
        };
        let (point_m, ns) = timed(|| {
            let answers = predictor.predict(&scene, &seen);
            answers.first().map(|a| a.point_m)
        });
        (point_m, ns)
    });
}

fn main() {
    println!("{}\n", Machine::detect(SEED));
    println!(
        "{} reaches of {} people to learn from, {} of {} others to be judged by; six points of the hand at 90 Hz.\n",
        TRAIN.1, TRAIN.0, TEST.1, TEST.0
    );
    let mut table = SpeedErrorTable::new("Where a reach ends", "judged at");
    estimator(&mut table, "hold", Hold::train);
    estimator(&mut table, "constant velocity", ConstantVelocity::train);
    estimator(&mut table, "minimum jerk", MinimumJerk::train);
    estimator(&mut table, "nearest neighbours", NearestNeighbour::train);
    estimator(&mut table, "ridge on five frames", RidgeWindow::train);
    for (method, combination) in [
        ("local regression", Combination::Regression),
        ("interaction primitive", Combination::Primitive),
        ("both", Combination::Both),
    ] {
        estimator(&mut table, method, |demonstrations| {
            Ok(learned(demonstrations, combination)?.estimator())
        });
    }
    for rays in [7, 19, 75] {
        fused(&mut table, rays);
    }
    println!("{}", table.to_markdown());
}
