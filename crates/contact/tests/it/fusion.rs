//! The fused predictor in the hard cases: the failures of a single ray.

use crate::common::{
    EYE, Fused, WALL, ball, following_the_motion, front, fused, gaze_at, plain_scene, room, scene,
    side,
};
use glam::{DMat3, DVec3};
use hwall_contact::{ContactPrediction, FusedConfig, PredictionSource};
use hwall_hand::GazeRay;
use hwall_scene::{Scene, SurfaceId};
use hwall_testkit::{Tol, assert_close};

/// Ignores the direction of motion and has no registration error.
fn by_estimate() -> Fused {
    Fused::new(FusedConfig {
        registration_sd_m: 0.0,
        ..following_the_motion()
    })
}

/// The probability of a surface.
fn probability(scene: &Scene, answers: &[ContactPrediction], name: &str) -> f64 {
    let of_surface = |a: &&ContactPrediction| Some(a.surface) == scene.find(name);
    let answer = answers.iter().find(of_surface);
    answer.map_or(0.0, |a| a.probability)
}

/// The surface that a line of sight meets.
fn meets(scene: &Scene, ray: GazeRay) -> Option<SurfaceId> {
    let hit = scene.ray_cast(ray.origin_m, ray.direction).unwrap();
    hit.map(|hit| hit.surface)
}

#[test]
fn an_estimate_off_the_wall_is_brought_to_it_by_its_covariance() {
    let sidecar = "[surface.wall]\nroughness = 0.4\n";
    let scene = scene(&[("wall", WALL)], Some(sidecar));
    let state = (DVec3::new(0.2, 0.0, 1.2), DVec3::X);
    // Errors in depth and height are correlated: 5 cm too deep is 2.5 cm too high.
    let c = DMat3::from_cols_array(&[0.0025, 0.0, 0.00125, 0.0, 0.0004, 0.0, 0.00125, 0.0, 0.0012]);
    let mut fused = by_estimate();
    let answers = fused.see(&scene, state, Some((DVec3::new(0.75, 0.1, 1.3), c)), None);
    let p = answers[0];
    assert_eq!((answers.len(), p.probability), (1, 1.0));
    assert_close!(p.point_m, DVec3::new(0.7, 0.1, 1.275), Tol::abs(1e-4));
    assert_close!(p.normal, DVec3::NEG_X, Tol::abs(1e-12));
    assert_close!(p.distance_m, 0.5, Tol::abs(1e-12));
    let c = p.covariance_m2.unwrap();
    // Without registration error, the wall position is known to a millimetre.
    assert_close!(c.x_axis, DVec3::X * 1e-6, Tol::abs(1e-12));
    assert_close!(c.y_axis.y, 0.0004, Tol::abs(2e-6));
    assert_close!(c.z_axis.z, 0.0012 - 0.00125 * 0.5, Tol::abs(2e-6));
    let said = (p.source, p.roughness);
    assert_eq!(said, (PredictionSource::Motion, Some(0.4)));
    assert_eq!(p.time_to_contact_s.unwrap().mean_s, 0.3);
}

#[test]
fn failure_gaze_misses_the_object() {
    // A post as wide as a hand; the gaze misses it by 5 degrees and meets the wall behind.
    let scene = plain_scene(&[
        ("wall", front(1.2, [-1.0, 1.0], [0.0, 2.0])),
        ("post", front(0.6, [-0.06, 0.06], [0.8, 1.6])),
    ]);
    let past = gaze_at(EYE, DVec3::new(0.6, 0.09, 1.2));
    assert_eq!(meets(&scene, past), scene.find("wall"));
    let mut fused = fused();
    let state = (DVec3::new(0.25, 0.0, 1.2), DVec3::X);
    let estimate = (DVec3::new(0.57, -0.01, 1.2), ball(0.04));
    let answers = fused.see(&scene, state, Some(estimate), Some(past));
    assert_eq!(Some(answers[0].surface), scene.find("post"));
    assert!(answers[0].probability > 0.95, "{answers:?}");
    assert!(answers[0].point_m.distance(DVec3::new(0.6, 0.0, 1.2)) < 0.04);
}

#[test]
fn failure_the_object_is_occluded() {
    // The eye sees a panel in front of the wall; the hand, next to the panel, is going to touch the wall.
    let scene = plain_scene(&[
        ("wall", WALL),
        ("panel", front(0.3, [0.0, 0.3], [1.25, 1.6])),
    ]);
    let meant = DVec3::new(0.7, 0.1, 1.1);
    let gaze = gaze_at(EYE, meant);
    assert_eq!(meets(&scene, gaze), scene.find("panel"));
    let mut fused = fused();
    let hand_m = DVec3::new(0.2, -0.1, 1.1);
    let state = (hand_m, meant - hand_m);
    let estimate = (DVec3::new(0.62, 0.07, 1.12), ball(0.06));
    let answers = fused.see(&scene, state, Some(estimate), Some(gaze));
    assert_eq!(Some(answers[0].surface), scene.find("wall"));
    assert!(answers[0].probability > 0.9, "{answers:?}");
    assert!(answers[0].point_m.distance(meant) < 0.035);
}

#[test]
fn failure_the_hand_is_already_behind_the_surface() {
    let scene = plain_scene(&[
        ("wall", WALL),
        ("next room", front(1.2, [-1.0, 1.0], [0.0, 2.0])),
    ]);
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
    // For a hand first seen there, the gaze shows on which side the person stands.
    let state = (DVec3::new(0.75, 0.0, 1.2), DVec3::X * 0.5);
    let estimate = Some((DVec3::new(0.8, 0.0, 1.2), ball(0.02)));
    let p = fused().see(&scene, state, estimate, gaze)[0];
    assert_eq!(Some(p.surface), scene.find("wall"));
    assert_close!(p.normal, DVec3::NEG_X, Tol::abs(1e-12));
}

#[test]
fn failure_two_surfaces_meet_in_a_corner() {
    let scene = plain_scene(&[
        ("front", front(0.7, [-1.0, 0.5], [0.0, 2.0])),
        ("side", side(0.5, [-0.5, 0.7], [0.0, 2.0])),
    ]);
    let corner = DVec3::new(0.7, 0.5, 1.2);
    let start = DVec3::new(0.2, 0.0, 1.2);
    let aimed = |aside_m: f64| {
        // From 6 cm on one wall around the corner to 6 cm on the other; the gaze moves along.
        let target_m = corner - DVec3::new(aside_m.max(0.0), (-aside_m).max(0.0), 0.0);
        let state = (start, (target_m - start).normalize());
        let estimate = Some((target_m, ball(0.03)));
        let mut fused = fused();
        let answers = fused.see(&scene, state, estimate, Some(gaze_at(EYE, target_m)));
        let [front, side] = ["front", "side"].map(|name| probability(&scene, answers, name));
        (front, side, answers.to_vec())
    };
    // Certain away from the corner, undecided at the corner, without a jump in between.
    assert!(aimed(-0.1).0 > 0.97 && aimed(0.1).1 > 0.97);
    let (front, side, answers) = aimed(0.0);
    for half in [front, side] {
        assert!((half - 0.5).abs() < 0.15, "{front} {side}");
    }
    // Both answers are in the corner: whichever is right, the board is near.
    assert!(answers.iter().all(|a| a.point_m.distance(corner) < 0.05));
    let mut before = aimed(-0.1).0;
    for i in -19..=20 {
        let now = aimed(0.005 * f64::from(i)).0;
        assert!((now - before).abs() < 0.2, "{before} -> {now} at {i}");
        before = now;
    }
}

#[test]
fn what_cannot_be_touched_bars_the_way_but_what_is_or_was_looked_at_is_thought_of() {
    let sidecar = "[surface.glass]\nkind = \"untouchable\"\n";
    let quads = [
        ("wall", WALL),
        ("glass", front(0.5, [-0.15, 1.0], [0.5, 1.8])),
        ("post", front(0.45, [-0.3, -0.1], [0.5, 1.8])),
    ];
    let scene = scene(&quads, Some(sidecar));
    let state = (DVec3::new(0.2, 0.0, 1.2), DVec3::X);
    let estimate = Some((DVec3::new(0.6, -0.05, 1.2), ball(0.08)));
    let mut fused = fused();
    let answers = fused.see(&scene, state, estimate, None);
    assert_eq!(Some(answers[0].surface), scene.find("post"));
    assert_eq!(probability(&scene, answers, "glass"), 0.0);
    // The hand may go round the glass. At the end the eyes see nothing touchable.
    let eye_m = DVec3::new(0.3, 0.0, 2.6);
    let at_wall = gaze_at(eye_m, DVec3::new(0.7, 0.05, 1.3));
    let away = gaze_at(eye_m, DVec3::new(0.3, 2.0, 2.8));
    for gaze in std::iter::repeat_n(at_wall, 20).chain([away]) {
        let answers = fused.see(&scene, state, estimate, Some(gaze));
        let wall = probability(&scene, answers, "wall");
        assert!(wall > 0.05, "{answers:?}");
    }
}

#[test]
fn a_gaze_that_has_left_still_counts() {
    let scene = plain_scene(&[
        ("left", front(0.7, [0.0, 0.6], [0.6, 1.8])),
        ("right", front(0.7, [-0.6, 0.0], [0.6, 1.8])),
    ]);
    let meant = DVec3::new(0.7, 0.07, 1.2);
    let state = (DVec3::new(0.3, 0.0, 1.2), DVec3::X);
    let estimate = Some((DVec3::new(0.7, -0.01, 1.2), ball(0.06)));
    let chance = fused().see(&scene, state, estimate, None)[0].probability;
    assert!(chance < 0.7, "{chance}");
    let after = |away: Option<GazeRay>| {
        let mut fused = fused();
        for _ in 0..30 {
            fused.see(&scene, state, estimate, Some(gaze_at(EYE, meant)));
        }
        let mut answers = Vec::new();
        for _ in 0..10 {
            answers = fused.see(&scene, state, estimate, away).to_vec();
        }
        assert_eq!(Some(answers[0].surface), scene.find("left"));
        assert!(answers[0].point_m.distance(meant) < 0.04);
        answers[0].probability
    };
    let dwells = [Some(meant), Some(DVec3::new(0.7, 1.4, 1.9)), None];
    let [still, away, lost] = dwells.map(|at_m| after(at_m.map(|at_m| gaze_at(EYE, at_m))));
    assert!(
        still > 0.75 && lost > 0.75 && away > chance,
        "{still} {away} {lost} {chance}"
    );
}

#[test]
fn a_hand_at_rest_is_told_by_the_gaze_or_by_what_is_near() {
    let quads = room(6);
    let scene = plain_scene(&quads);
    let rest = (DVec3::new(0.0, 0.0, 1.2), DVec3::ZERO);
    let meant = DVec3::new(0.65, 0.1, 1.5);
    let mut with_gaze = fused();
    let p = with_gaze.see(&scene, rest, None, Some(gaze_at(EYE, meant)))[0];
    let picture = scene.find("picture").unwrap();
    assert_eq!((p.surface, p.source), (picture, PredictionSource::Gaze));
    assert!(p.point_m.distance(meant) < 0.08 && p.time_to_contact_s.is_none());
    assert!((0.7..0.99).contains(&p.probability), "{p:?}");
    // Without gaze only nearby surfaces are predicted.
    let p = fused().see(&scene, (DVec3::new(0.4, 0.2, 1.5), DVec3::ZERO), None, None)[0];
    assert_eq!((p.surface, p.source), (picture, PredictionSource::Nearest));
    assert!(fused().see(&scene, rest, None, None).is_empty());
}

#[test]
fn a_change_of_mind_is_followed_within_the_sample_in_which_it_shows() {
    let scene = plain_scene(&[
        ("left", front(0.7, [0.1, 0.6], [0.6, 1.8])),
        ("right", front(0.7, [-0.6, -0.1], [0.6, 1.8])),
    ]);
    let mut fused = fused();
    let state = (DVec3::new(0.3, 0.0, 1.2), DVec3::X);
    for (y, name) in [(0.3, "left"), (-0.3, "right"), (0.3, "left")] {
        let meant = DVec3::new(0.7, y, 1.2);
        for _ in 0..40 {
            let (estimate, gaze) = ((meant, ball(0.08)), gaze_at(EYE, meant));
            let p = fused.see(&scene, state, Some(estimate), Some(gaze))[0];
            assert_eq!(Some(p.surface), scene.find(name));
        }
    }
}

#[test]
fn an_estimate_beyond_every_edge_goes_to_the_closest_surface() {
    let scene = plain_scene(&[("tile", front(0.7, [-0.05, 0.05], [1.1, 1.2]))]);
    let state = (DVec3::new(0.3, 0.0, 1.2), DVec3::X);
    let estimate = Some((DVec3::new(0.7, 0.2, 1.15), ball(0.05)));
    let p = by_estimate().see(&scene, state, estimate, None)[0];
    assert_close!(p.point_m, DVec3::new(0.7, 0.05, 1.15), Tol::abs(1e-9));
}

#[test]
fn an_estimate_wrong_by_many_deviations_in_depth_is_not_sure_of_the_rest() {
    let scene = plain_scene(&[("wall", WALL)]);
    let state = (DVec3::new(0.2, 0.0, 1.2), DVec3::X);
    let sd_m = |depth_m: f64| {
        let at = DVec3::new(0.7 - depth_m, 0.0, 1.2);
        let p = by_estimate().see(&scene, state, Some((at, ball(0.02))), None)[0];
        p.covariance_m2.unwrap().y_axis.y.sqrt()
    };
    // Up to three standard deviations the stated covariance applies; ten give 1 + (100 - 9) / 5 times the variance.
    assert_close!(sd_m(0.02), 0.02, Tol::abs(1e-4));
    assert_close!(sd_m(0.05), 0.02, Tol::abs(1e-4));
    let more_m = 0.02 * (1.0 + 91.0_f64 / 5.0).sqrt();
    assert_close!(sd_m(0.2), more_m, Tol::rel(0.02));
}
