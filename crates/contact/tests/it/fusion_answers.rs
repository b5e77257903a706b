//! Invariants of every answer of the fused predictor, and its settings.

use crate::common::{
    EYE, Fused, Scripted, WALL, ball, error, fused, gaze_at, hand, plain_scene, room, see, target,
};
use glam::{DMat3, DVec3};
use hwall_contact::{
    DeterministicConfig, DeterministicPredictor, FusedConfig, FusedPredictor, PredictionSource,
};
use hwall_hand::{Fixation, Gaze, GazeRay};
use hwall_testkit::{Sampler, refused};

#[test]
fn no_number_that_is_none_comes_out() {
    let quads = room(12);
    let scene = plain_scene(&quads);
    let bad = [f64::NAN, f64::INFINITY, -1e300, 0.0, 1e-300];
    let mut sampler = Sampler::new(5);
    let mut fused = fused();
    let mut led = DeterministicPredictor::new(DeterministicConfig::ray_led()).unwrap();
    for _ in 0..3000 {
        let mut point = |nominal: DVec3| {
            let mut p = nominal.to_array();
            if sampler.uniform(0.0, 1.0) < 0.3 {
                p[sampler.index(3)] = bad[sampler.index(bad.len())];
            }
            DVec3::from_array(p)
        };
        let (hand_m, velocity) = (point(DVec3::new(0.1, 0.0, 1.2)), point(DVec3::X));
        let mean_m = point(DVec3::new(0.6, 0.0, 1.2));
        let covariance = DMat3::from_diagonal(point(DVec3::splat(0.01)));
        let gaze = GazeRay {
            origin_m: point(EYE),
            direction: point(DVec3::X),
        };
        let [noise_rad, since_s, _] = point(DVec3::new(0.01, 0.0, 0.0)).to_array();
        let gaze = Gaze::Fixed(Fixation {
            noise_rad,
            since_s,
            ..Fixation::of_ray(0.0, fused.now_s() + 0.01, gaze)
        });
        let state = hand(fused.now_s() + 0.01, hand_m, velocity);
        let by_ray = see(&mut led, &scene, &state, gaze).iter();
        let estimate = Some((mean_m, covariance));
        for a in by_ray.chain(fused.see_with(&scene, (hand_m, velocity), estimate, gaze)) {
            assert!(a.point_m.is_finite() && a.normal.is_normalized() && a.distance_m.is_finite());
            assert!(a.probability > 0.0 && a.probability <= 1.0);
            assert!(a.covariance_m2.is_none_or(|c| c.is_finite()), "{a:?}");
            assert!(a.time_to_contact_s.is_none_or(|t| t.mean_s.is_finite()));
        }
    }
    let nan = hand(f64::NAN, DVec3::NAN, DVec3::NAN);
    assert!(see(&mut fused.predictor, &scene, &nan, Gaze::Lost).is_empty());
    // The predictor recovers.
    let state = (DVec3::new(0.1, 0.0, 1.2), DVec3::X);
    let estimate = Some((DVec3::new(0.6, 0.0, 1.2), ball(0.05)));
    assert!(!fused.see(&scene, state, estimate, None).is_empty());
}

#[test]
fn every_covariance_is_symmetric_and_positive_definite() {
    let mut sampler = Sampler::new(41);
    let mut seen = 0;
    for round in 0..300 {
        let names = ["a", "b", "c", "d", "e"];
        let quads = names.map(|name| {
            let corner = DVec3::new(0.4, 0.0, 1.2) + sampler.unit_vector() * 0.3;
            let turn = sampler.rotation();
            let [u, v] = [turn.x_axis, turn.y_axis].map(|e| e * sampler.uniform(0.02, 1.0));
            let corners = [corner, corner + u, corner + u + v, corner + v];
            (name, corners.map(|p| p.to_array()))
        });
        let scene = plain_scene(&quads);
        let mut fused = Fused::new(FusedConfig {
            registration_sd_m: [0.0, 0.008][round % 2],
            ..FusedConfig::default()
        });
        for _ in 0..10 {
            // From needle-shaped to spherical covariances, at rest and under way.
            let sd_m = DVec3::new(0.0, sampler.uniform(0.0, 0.01), sampler.uniform(0.0, 0.5));
            let (off_m, covariance) = error(&mut sampler, sd_m);
            let velocity = sampler.unit_vector() * [0.0, 1.0][sampler.index(2)];
            let hand_m = DVec3::new(0.1, 0.0, 1.2) + sampler.unit_vector() * 0.3;
            let end_m = DVec3::new(0.5, 0.0, 1.2) + off_m;
            let estimate = (velocity.length() > 0.0).then_some((end_m, covariance));
            let gaze = sampler.bool().then(|| gaze_at(EYE, end_m));
            for answer in fused.see(&scene, (hand_m, velocity), estimate, gaze) {
                // The fallback has no covariance.
                let Some(c) = answer.covariance_m2 else {
                    continue;
                };
                assert_eq!(c, c.transpose());
                // Squared diagonal of a Cholesky factor: the smallest entry is not an eigenvalue but has its sign.
                let a = c.x_axis.x;
                let b = c.y_axis.y - c.x_axis.y.powi(2) / a;
                let pivots = [a, b, c.determinant() / (a * b)];
                assert!(pivots.iter().all(|p| *p > 1e-9), "{pivots:?}");
                seen += 1;
            }
        }
    }
    assert!(seen > 2000, "{seen}");
}

#[test]
fn a_time_is_told_of_a_hand_that_clearly_closes_in() {
    let scene = plain_scene(&[("wall", WALL)]);
    let gaze = Some(gaze_at(EYE, DVec3::new(0.7, 0.0, 1.2)));
    let due_s = |speed: f64| {
        let state = (DVec3::new(0.3, 0.0, 1.2), DVec3::X * speed);
        let p = fused().see(&scene, state, None, gaze)[0];
        p.time_to_contact_s.map(|t| t.mean_s)
    };
    assert_eq!([-0.5, 0.0, 0.05, 0.12].map(due_s), [None; 4]);
    assert!((due_s(0.4).unwrap() - 1.0).abs() < 0.1);
}

#[test]
fn the_best_answer_is_kept_however_improbable() {
    let quads = room(12);
    let scene = plain_scene(&quads);
    let mut fused = Fused::new(FusedConfig {
        min_probability: 0.99,
        ..FusedConfig::default()
    });
    let state = (DVec3::new(0.0, 0.0, 1.2), DVec3::X);
    let estimate = Some((DVec3::new(0.6, 0.1, 1.1), ball(0.1)));
    let answers = fused.see(&scene, state, estimate, None);
    assert_eq!((answers.len(), answers[0].probability), (1, 1.0));
    assert_eq!(answers[0].source, PredictionSource::Motion);
}

#[test]
fn a_prediction_does_not_allocate() {
    let quads = room(12);
    let scene = plain_scene(&quads);
    let mut fused = fused();
    let mut sampler = Sampler::new(3);
    let mut run = |samples: usize| {
        for _ in 0..samples {
            let hand_m = DVec3::new(0.0, 0.0, 1.2);
            let (_, contact_m) = target(&mut sampler, &scene, &quads, hand_m);
            let (off_m, covariance) = error(&mut sampler, DVec3::splat(0.15));
            let state = (hand_m, contact_m - hand_m);
            let gaze = Some(gaze_at(EYE, contact_m));
            let estimate = (contact_m + off_m, covariance);
            assert!(!fused.see(&scene, state, Some(estimate), gaze).is_empty());
        }
    };
    run(200);
    let info = allocation_counter::measure(|| run(200));
    assert_eq!(info.count_total, 0);
}

#[test]
fn settings_outside_their_range_are_refused() {
    let make = |config| FusedPredictor::new(Scripted::default(), config);
    refused!(FusedConfig::default(), make, {
        rays = 0;
        registration_sd_m = f64::NAN;
        evidence.on_target_sd_rad = f64::NAN;
        evidence.rest.covariance_m2 = DMat3::ZERO;
        min_probability = 1.0;
        watch.offset_m_per_s = 1.0 => "onset_m_per_s - offset_m_per_s";
        fallback.max_distance_m = 0.0;
    });
}
