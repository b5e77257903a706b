//! The fused predictor in the hard cases: the failures of a single ray, and bad input.

mod common;

use common::{Fused, Scripted, blurred, error, front, gaze_at, hand, room, scene, side, target};
use glam::{DMat3, DVec3};
use hwall_contact::{
    ContactError, FusedConfig, FusedPredictor, GazeModel, PredictionSource, Predictor,
    PredictorInput,
};
use hwall_hand::{GazeRay, HandFrame, HandPoint, LabelledReach};
use hwall_scene::Scene;
use hwall_testkit::{Sampler, Tol, assert_close};

const EYE: DVec3 = DVec3::new(-0.25, 0.1, 1.6);

fn fused() -> Fused {
    Fused::new(FusedConfig::default())
}

/// Without a say of the direction of motion, registered without error.
fn by_estimate() -> Fused {
    Fused::new(FusedConfig {
        bend: None,
        registration_sd_m: 0.0,
        ..FusedConfig::default()
    })
}

fn ball(sd_m: f64) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(sd_m * sd_m))
}

/// The names and probabilities of the answers.
fn named(scene: &Scene, answers: &[hwall_contact::ContactPrediction]) -> Vec<(String, f64)> {
    answers
        .iter()
        .map(|a| (scene.surface(a.surface).name.clone(), a.probability))
        .collect()
}

const WALL: common::Quad = [
    [0.7, 1.0, 0.0],
    [0.7, -1.0, 0.0],
    [0.7, -1.0, 2.0],
    [0.7, 1.0, 2.0],
];

#[test]
fn an_estimate_off_the_wall_is_brought_to_it_by_its_covariance() {
    let sidecar = "[surface.wall]\nroughness = 0.4\n";
    let scene = scene(&[("wall", WALL)], Some(sidecar));
    let state = (DVec3::new(0.2, 0.0, 1.2), DVec3::X);
    // Depth and height err together: 5 cm too deep is 2.5 cm too high.
    let c = DMat3::from_cols_array(&[0.0025, 0.0, 0.00125, 0.0, 0.0004, 0.0, 0.00125, 0.0, 0.0012]);
    let mut fused = by_estimate();
    let answers = fused.see(&scene, state, Some((DVec3::new(0.75, 0.1, 1.3), c)), None);
    let p = answers[0];
    assert_eq!((answers.len(), p.probability), (1, 1.0));
    assert_close!(p.point_m, DVec3::new(0.7, 0.1, 1.275), Tol::abs(1e-4));
    assert_close!(p.normal, DVec3::NEG_X, Tol::abs(1e-12));
    assert_close!(p.distance_m, 0.5, Tol::abs(1e-12));
    let c = p.covariance_m2.unwrap();
    // Registered without error, the wall is where it is to a millimetre.
    assert_close!(c.x_axis, DVec3::X * 1e-6, Tol::abs(1e-12));
    assert_close!(c.y_axis.y, 0.0004, Tol::abs(2e-6));
    assert_close!(c.z_axis.z, 0.0012 - 0.00125 * 0.5, Tol::abs(2e-6));
    assert_eq!(
        (p.source, p.roughness),
        (PredictionSource::Motion, Some(0.4))
    );
    assert_eq!(p.time_to_contact_s.unwrap().mean_s, 0.3);
}

#[test]
fn failure_gaze_misses_the_object() {
    // A post as wide as a hand; the gaze passes it by 5 degrees and meets the wall behind.
    let scene = scene(
        &[
            ("wall", front(1.2, [-1.0, 1.0], [0.0, 2.0])),
            ("post", front(0.6, [-0.06, 0.06], [0.8, 1.6])),
        ],
        None,
    );
    let past = gaze_at(EYE, DVec3::new(0.6, 0.09, 1.2));
    let hit = scene
        .ray_cast(past.origin_m, past.direction)
        .unwrap()
        .unwrap();
    assert_eq!(Some(hit.surface), scene.find("wall"));
    let mut fused = fused();
    let state = (DVec3::new(0.25, 0.0, 1.2), DVec3::X);
    let estimate = (DVec3::new(0.57, -0.01, 1.2), ball(0.04));
    let answers = fused.see(&scene, state, Some(estimate), Some(past));
    assert_eq!(Some(answers[0].surface), scene.find("post"));
    assert!(
        answers[0].probability > 0.95,
        "{:?}",
        named(&scene, answers)
    );
    assert!(answers[0].point_m.distance(DVec3::new(0.6, 0.0, 1.2)) < 0.04);
}

#[test]
fn failure_the_object_is_occluded() {
    // The eye sees a panel before the wall that the hand, beside the panel, is going to touch.
    let scene = scene(
        &[
            ("wall", WALL),
            ("panel", front(0.3, [0.0, 0.3], [1.25, 1.6])),
        ],
        None,
    );
    let meant = DVec3::new(0.7, 0.1, 1.1);
    let gaze = gaze_at(EYE, meant);
    let hit = scene
        .ray_cast(gaze.origin_m, gaze.direction)
        .unwrap()
        .unwrap();
    assert_eq!(
        Some(hit.surface),
        scene.find("panel"),
        "the gaze alone is wrong"
    );
    let mut fused = fused();
    let state = (
        DVec3::new(0.2, -0.1, 1.1),
        meant - DVec3::new(0.2, -0.1, 1.1),
    );
    let estimate = (DVec3::new(0.62, 0.07, 1.12), ball(0.06));
    let answers = fused.see(&scene, state, Some(estimate), Some(gaze));
    assert_eq!(Some(answers[0].surface), scene.find("wall"));
    assert!(answers[0].probability > 0.9, "{:?}", named(&scene, answers));
    assert!(answers[0].point_m.distance(meant) < 0.035);
}

#[test]
fn failure_the_hand_is_already_behind_the_surface() {
    let scene = scene(
        &[
            ("wall", WALL),
            ("next room", front(1.2, [-1.0, 1.0], [0.0, 2.0])),
        ],
        None,
    );
    let gaze = Some(gaze_at(EYE, DVec3::new(0.7, 0.0, 1.2)));
    for gaze in [gaze, None] {
        let mut fused = fused();
        for x in [0.6, 0.66, 0.72, 0.76] {
            let state = (DVec3::new(x, 0.0, 1.2), DVec3::X);
            let estimate = Some((DVec3::new(x + 0.02, 0.0, 1.2), ball(0.01)));
            let p = fused.see(&scene, state, estimate, gaze)[0];
            assert_eq!(Some(p.surface), scene.find("wall"), "{x}");
            assert_close!(p.normal, DVec3::NEG_X, Tol::abs(1e-12));
            assert_close!(p.distance_m, 0.7 - x, Tol::abs(1e-9));
            let due_s = p.time_to_contact_s.unwrap().mean_s;
            assert_eq!(due_s == 0.0, x > 0.7);
        }
    }
    // PredictorInput there for the first time, the gaze tells where the person stands.
    let state = (DVec3::new(0.75, 0.0, 1.2), DVec3::X * 0.5);
    let p = fused().see(
        &scene,
        state,
        Some((DVec3::new(0.8, 0.0, 1.2), ball(0.02))),
        gaze,
    )[0];
    assert_eq!(Some(p.surface), scene.find("wall"));
    assert_close!(p.normal, DVec3::NEG_X, Tol::abs(1e-12));
}

#[test]
fn failure_two_surfaces_meet_in_a_corner() {
    let scene = scene(
        &[
            ("front", front(0.7, [-1.0, 0.5], [0.0, 2.0])),
            ("side", side(0.5, [-0.5, 0.7], [0.0, 2.0])),
        ],
        None,
    );
    let corner = DVec3::new(0.7, 0.5, 1.2);
    let start = DVec3::new(0.2, 0.0, 1.2);
    let aimed = |aside_m: f64| {
        // From 6 cm on one wall round the corner to 6 cm on the other; the gaze goes along.
        let target_m = corner
            - if aside_m < 0.0 {
                DVec3::Y * -aside_m
            } else {
                DVec3::X * aside_m
            };
        let answers = fused()
            .see(
                &scene,
                (start, (target_m - start).normalize()),
                Some((target_m, ball(0.03))),
                Some(gaze_at(EYE, target_m)),
            )
            .to_vec();
        let p = |name| {
            answers
                .iter()
                .find(|a| Some(a.surface) == scene.find(name))
                .map_or(0.0, |a| a.probability)
        };
        (p("front"), p("side"), answers)
    };
    // Sure away from the corner, undecided in it, and no leap between.
    assert!(aimed(-0.1).0 > 0.97 && aimed(0.1).1 > 0.97);
    let (front, side, answers) = aimed(0.0);
    assert!(
        (front - 0.5).abs() < 0.15 && (side - 0.5).abs() < 0.15,
        "{front} {side}"
    );
    // Both answers lie in the corner: whichever is right, the board is not far.
    assert!(answers.iter().all(|a| a.point_m.distance(corner) < 0.05));
    let mut before = aimed(-0.1).0;
    for i in -19..=20 {
        let now = aimed(0.005 * f64::from(i)).0;
        assert!((now - before).abs() < 0.2, "{before} -> {now} at {i}");
        before = now;
    }
}

#[test]
fn what_cannot_be_touched_bars_the_way() {
    let sidecar = "[surface.glass]\nkind = \"untouchable\"\n";
    let quads = [
        ("wall", WALL),
        ("glass", front(0.5, [-0.15, 1.0], [0.5, 1.8])),
        ("post", front(0.45, [-0.3, -0.1], [0.5, 1.8])),
    ];
    let scene = scene(&quads, Some(sidecar));
    let state = (DVec3::new(0.2, 0.0, 1.2), DVec3::X);
    let estimate = Some((DVec3::new(0.6, -0.05, 1.2), ball(0.08)));
    let mut fused = by_estimate();
    let answers = fused.see(&scene, state, estimate, None);
    assert_eq!(Some(answers[0].surface), scene.find("post"));
    assert!(
        answers
            .iter()
            .all(|a| Some(a.surface) != scene.find("glass"))
    );
    // Looked at, the wall is thought of as well: the hand may go round.
    let answers = fused.see(
        &scene,
        state,
        estimate,
        Some(gaze_at(
            DVec3::new(0.3, 0.0, 2.6),
            DVec3::new(0.7, 0.05, 1.3),
        )),
    );
    let wall = answers
        .iter()
        .find(|a| Some(a.surface) == scene.find("wall"));
    assert!(
        wall.is_some_and(|w| w.probability > 0.05),
        "{:?}",
        named(&scene, answers)
    );
}

#[test]
fn a_barred_place_that_was_looked_at_before_is_thought_of_as_well() {
    let sidecar = "[surface.glass]\nkind = \"untouchable\"\n";
    let quads = [
        ("wall", WALL),
        ("glass", front(0.5, [-0.15, 1.0], [0.5, 1.8])),
        ("post", front(0.45, [-0.3, -0.1], [0.5, 1.8])),
    ];
    let scene = scene(&quads, Some(sidecar));
    let state = (DVec3::new(0.2, 0.0, 1.2), DVec3::X);
    let estimate = Some((DVec3::new(0.6, -0.05, 1.2), ball(0.08)));
    let eye_m = DVec3::new(0.3, 0.0, 2.6);
    let mut fused = by_estimate();
    let mut wall = |gaze: GazeRay| {
        let answers = fused.see(&scene, state, estimate, Some(gaze));
        let of_wall = |a: &&hwall_contact::ContactPrediction| Some(a.surface) == scene.find("wall");
        answers.iter().find(of_wall).map_or(0.0, |a| a.probability)
    };
    for _ in 0..20 {
        wall(gaze_at(eye_m, DVec3::new(0.7, 0.05, 1.3)));
    }
    // Now the eyes see nothing that could be touched.
    let left = wall(gaze_at(eye_m, DVec3::new(0.3, 2.0, 2.8)));
    assert!(left > 0.05, "{left}");
}

#[test]
fn a_gaze_that_has_left_still_counts() {
    let scene = scene(
        &[
            ("left", front(0.7, [0.0, 0.6], [0.6, 1.8])),
            ("right", front(0.7, [-0.6, 0.0], [0.6, 1.8])),
        ],
        None,
    );
    let meant = DVec3::new(0.7, 0.07, 1.2);
    let state = (DVec3::new(0.3, 0.0, 1.2), DVec3::X);
    let estimate = Some((DVec3::new(0.7, -0.01, 1.2), ball(0.06)));
    let chance = fused().see(&scene, state, estimate, None)[0].probability;
    assert!(chance < 0.7, "{chance}");
    let probability = |away: Option<GazeRay>| {
        let mut fused = fused();
        for _ in 0..30 {
            fused.see(&scene, state, estimate, Some(gaze_at(EYE, meant)));
        }
        let mut answers = Vec::new();
        for _ in 0..10 {
            answers = fused.see(&scene, state, estimate, away).to_vec();
        }
        let left = answers
            .iter()
            .find(|a| Some(a.surface) == scene.find("left"))
            .unwrap();
        (left.probability, left.point_m.distance(meant))
    };
    let stayed = probability(Some(gaze_at(EYE, meant)));
    let left = probability(Some(gaze_at(EYE, DVec3::new(0.7, 1.4, 1.9))));
    let blinked = probability(None);
    assert!(
        stayed.0 > 0.9 && left.0 > 0.85 && blinked.0 > 0.85,
        "{stayed:?} {left:?} {blinked:?}"
    );
    assert!(stayed.1 < 0.04 && left.1 < 0.04 && blinked.1 < 0.04);
}

#[test]
fn a_hand_at_rest_is_told_by_the_gaze_or_by_what_is_near() {
    let quads = room(6);
    let scene = scene(&quads, None);
    let rest = (DVec3::new(0.0, 0.0, 1.2), DVec3::ZERO);
    let meant = DVec3::new(0.65, 0.1, 1.5);
    let mut with_gaze = fused();
    let p = with_gaze.see(&scene, rest, None, Some(gaze_at(EYE, meant)))[0];
    assert_eq!(
        (Some(p.surface), p.source),
        (scene.find("picture"), PredictionSource::Gaze)
    );
    assert!(p.point_m.distance(meant) < 0.08 && p.time_to_contact_s.is_none());
    assert!(
        p.probability > 0.7 && p.probability < 0.99,
        "{}",
        p.probability
    );
    // Without a gaze there is only what is near.
    let p = fused().see(&scene, (DVec3::new(0.4, 0.2, 1.5), DVec3::ZERO), None, None)[0];
    assert_eq!(
        (Some(p.surface), p.source),
        (scene.find("picture"), PredictionSource::Nearest)
    );
    assert!(fused().see(&scene, rest, None, None).is_empty());
}

#[test]
fn a_change_of_mind_is_followed_within_the_sample_in_which_it_shows() {
    let scene = scene(
        &[
            ("left", front(0.7, [0.1, 0.6], [0.6, 1.8])),
            ("right", front(0.7, [-0.6, -0.1], [0.6, 1.8])),
        ],
        None,
    );
    let mut fused = fused();
    let state = (DVec3::new(0.3, 0.0, 1.2), DVec3::X);
    for (y, name) in [(0.3, "left"), (-0.3, "right"), (0.3, "left")] {
        let meant = DVec3::new(0.7, y, 1.2);
        for _ in 0..40 {
            let p = fused.see(
                &scene,
                state,
                Some((meant, ball(0.08))),
                Some(gaze_at(EYE, meant)),
            )[0];
            assert_eq!(Some(p.surface), scene.find(name));
        }
    }
}

#[test]
fn a_hand_near_the_surface_is_believed_more_than_the_estimate() {
    // 2 cm before the wall, straight at it, the estimate 2 cm aside.
    let scene = scene(&[("wall", WALL)], None);
    let state = (DVec3::new(0.68, 0.0, 1.2), DVec3::X);
    let estimate = Some((DVec3::new(0.7, 0.02, 1.2), ball(0.015)));
    let off_m = |fused: &mut Fused| fused.see(&scene, state, estimate, None)[0].point_m.y;
    assert!(off_m(&mut by_estimate()) > 0.019);
    assert!(off_m(&mut fused()) < 0.008);
    // From afar the estimate knows better.
    let afar = (DVec3::new(0.2, 0.0, 1.2), DVec3::X);
    assert!(fused().see(&scene, afar, estimate, None)[0].point_m.y > 0.019);
}

#[test]
fn an_estimate_beyond_every_edge_goes_to_the_closest_surface() {
    let scene = scene(&[("tile", front(0.7, [-0.05, 0.05], [1.1, 1.2]))], None);
    let state = (DVec3::new(0.3, 0.0, 1.2), DVec3::X);
    let p = by_estimate().see(
        &scene,
        state,
        Some((DVec3::new(0.7, 0.2, 1.15), ball(0.05))),
        None,
    )[0];
    assert_close!(p.point_m, DVec3::new(0.7, 0.05, 1.15), Tol::abs(1e-9));
}

#[test]
fn no_number_that_is_none_comes_out() {
    let quads = room(12);
    let scene = scene(&quads, None);
    let bad = [f64::NAN, f64::INFINITY, -1e300, 0.0, 1e-300];
    let mut sampler = Sampler::new(5);
    let mut fused = fused();
    for _ in 0..3000 {
        let mut point = |usual: DVec3| {
            let mut p = usual.to_array();
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
        for a in fused.see(
            &scene,
            (hand_m, velocity),
            Some((mean_m, covariance)),
            Some(gaze),
        ) {
            assert!(a.point_m.is_finite() && a.normal.is_normalized() && a.distance_m.is_finite());
            assert!(a.probability > 0.0 && a.probability <= 1.0);
            assert!(a.covariance_m2.is_none_or(|c| c.is_finite()));
            assert!(a.time_to_contact_s.is_none_or(|t| t.mean_s.is_finite()));
        }
    }
    let nan = hand(f64::NAN, DVec3::NAN, DVec3::NAN);
    let seen = PredictorInput {
        frame: &HandFrame::empty(f64::NAN),
        hand: Some(&nan),
        gaze: None,
    };
    assert!(fused.predictor.predict(&scene, &seen).is_empty());
    // And it recovers.
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
        let scene = scene(&quads, None);
        let mut fused = Fused::new(FusedConfig {
            registration_sd_m: [0.0, 0.008][round % 2],
            ..FusedConfig::default()
        });
        for _ in 0..10 {
            // From a needle to a ball, at rest and under way.
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
                // Squares of the diagonal of a Cholesky factor: the smallest is no eigenvalue but has its sign.
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
    let scene = scene(&[("wall", WALL)], None);
    let mut due_s = |speed: f64| {
        let state = (DVec3::new(0.3, 0.0, 1.2), DVec3::X * speed);
        let p = fused().see(
            &scene,
            state,
            None,
            Some(gaze_at(EYE, DVec3::new(0.7, 0.0, 1.2))),
        )[0];
        p.time_to_contact_s.map(|t| t.mean_s)
    };
    assert_eq!([-0.5, 0.0, 0.05, 0.12].map(&mut due_s), [None; 4]);
    assert!((due_s(0.4).unwrap() - 1.0).abs() < 0.1);
}

#[test]
fn the_best_answer_is_kept_however_improbable() {
    let quads = room(12);
    let scene = scene(&quads, None);
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
    let scene = scene(&quads, None);
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
fn how_people_look_is_learnt_from_their_reaches() {
    let planted = GazeModel {
        on_target_sd_rad: 0.05,
        elsewhere_share: 0.3,
        elsewhere_sd_rad: 0.4,
        ..GazeModel::default()
    };
    let mut sampler = Sampler::new(77);
    let reaches: Vec<LabelledReach> = (0..400)
        .map(|_| {
            let contact_m = DVec3::new(0.7, sampler.normal() * 0.2, 1.2);
            let frames = (0..5)
                .map(|i| {
                    let mut frame = HandFrame::empty(0.1 * f64::from(i));
                    frame.palm_m = Some(DVec3::ZERO);
                    frame.head_m = Some(EYE);
                    let spread = if sampler.uniform(0.0, 1.0) < planted.elsewhere_share {
                        planted.elsewhere_sd_rad
                    } else {
                        planted.on_target_sd_rad
                    };
                    let exact = gaze_at(EYE, contact_m).direction;
                    frame.gaze = Some(blurred(&mut sampler, exact, spread));
                    frame
                })
                .collect();
            LabelledReach {
                person: None,
                trial: None,
                point: HandPoint::Palm,
                frames,
                contact_m,
                contact_s: 0.5,
                normal: None,
            }
        })
        .collect();
    let learnt = GazeModel::default().fit(&reaches).unwrap();
    assert_close!(
        learnt.on_target_sd_rad,
        planted.on_target_sd_rad,
        Tol::new(0.0, 0.1)
    );
    assert_close!(
        learnt.elsewhere_sd_rad,
        planted.elsewhere_sd_rad,
        Tol::new(0.0, 0.1)
    );
    assert_close!(
        learnt.elsewhere_share,
        planted.elsewhere_share,
        Tol::abs(0.05)
    );
    assert!(matches!(
        GazeModel::default().fit(&reaches[..2]),
        Err(ContactError::TooFewReaches { .. })
    ));
}

#[test]
fn settings_outside_their_range_are_refused() {
    let bad = |change: &dyn Fn(&mut FusedConfig)| {
        let mut config = FusedConfig::default();
        change(&mut config);
        FusedPredictor::new(Scripted::default(), config).is_err()
    };
    assert!(bad(&|c| c.rays = 0));
    assert!(bad(&|c| c.registration_sd_m = f64::NAN));
    assert!(bad(&|c| c.bend = Some(0.0)));
    assert!(bad(&|c| c.gaze.elsewhere_share = 1.5));
    assert!(bad(&|c| c.min_probability = 1.0));
    assert!(bad(&|c| c.watch.offset_m_per_s = 1.0));
    assert!(bad(&|c| c.fallback.max_distance_m = 0.0));
    assert!(!bad(&|_| {}));
}
