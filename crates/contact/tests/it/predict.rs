//! Deterministic prediction: required behaviour and known failures.

use crate::common::{self, Quad, fixed, front, plain_scene, scene, see, side};
use glam::DVec3;
use hwall_contact::PredictionSource::{Gaze, HandDirection};
use hwall_contact::{
    ContactPrediction, DeterministicConfig, DeterministicPredictor, PredictionSource,
};
use hwall_hand::{GazeRay, HandState};
use hwall_scene::{Scene, SurfaceId};
use hwall_testkit::{Sampler, Tol, assert_close};

fn found(scene: &Scene, name: &str) -> SurfaceId {
    scene.find(name).unwrap()
}

/// A wall at a given x, seen from smaller x, spanning y from -1 to 1 and z from 0 to 2.
fn wall(x: f64) -> Quad {
    front(x, [-1.0, 1.0], [0.0, 2.0])
}

fn hand(point_m: DVec3, velocity_m_per_s: DVec3) -> HandState {
    common::hand(0.0, point_m, velocity_m_per_s)
}

const HEAD: DVec3 = DVec3::new(-0.2, 0.0, 1.6);

fn gaze_at(target_m: DVec3) -> GazeRay {
    common::gaze_at(HEAD, target_m)
}

fn predict(scene: &Scene, hand: &HandState, gaze: Option<GazeRay>) -> Option<ContactPrediction> {
    predict_with(&mut DeterministicPredictor::default(), scene, hand, gaze)
}

fn due_s(prediction: &ContactPrediction) -> f64 {
    prediction.time_to_contact_s.unwrap().mean_s
}

fn predict_with(
    predictor: &mut DeterministicPredictor,
    scene: &Scene,
    hand: &HandState,
    gaze: Option<GazeRay>,
) -> Option<ContactPrediction> {
    let gaze = fixed(hand.t_s, gaze);
    see(predictor, scene, hand, gaze).first().copied()
}

#[test]
fn a_receding_or_resting_hand_has_no_time_to_contact_and_one_on_the_wall_touches_now() {
    let scene = plain_scene(&[("wall", wall(1.0))]);
    let gaze = Some(gaze_at(DVec3::new(1.0, 0.0, 1.0)));
    for (x, velocity, due_s) in [
        (0.4, DVec3::NEG_X, None),
        (0.4, DVec3::Y, None),
        (0.4, DVec3::ZERO, None),
        (0.4, DVec3::X * 0.01, None),
        (1.0, DVec3::X, Some(0.0)),
    ] {
        let p = predict(&scene, &hand(DVec3::new(x, 0.0, 1.2), velocity), gaze).unwrap();
        assert_eq!((p.source, p.surface), (Gaze, found(&scene, "wall")));
        assert_eq!(p.time_to_contact_s.map(|t| t.mean_s), due_s, "{velocity}");
        assert_close!(p.distance_m, 1.0 - x, Tol::abs(1e-9));
    }
}

#[test]
fn failure_gaze_misses_the_object() {
    let scene = plain_scene(&[("wall", wall(1.0))]);
    let past = Some(GazeRay {
        origin_m: HEAD,
        direction: DVec3::Z,
    });
    let approaching = hand(DVec3::new(0.0, 0.1, 1.2), DVec3::new(1.0, 0.2, 0.0));
    let p = predict(&scene, &approaching, past).unwrap();
    assert_eq!(p.source, HandDirection);
    assert_close!(p.point_m, DVec3::new(1.0, 0.1, 1.2), Tol::abs(1e-12));
    // Without gaze and direction of motion, only nearby surfaces are predicted.
    let idle = |x: f64| hand(DVec3::new(x, 0.1, 1.2), DVec3::ZERO);
    assert_eq!(predict(&scene, &idle(0.0), past), None);
    let p = predict(&scene, &idle(0.8), past).unwrap();
    assert_eq!(p.source, PredictionSource::Nearest);
    let away = hand(DVec3::new(0.0, 0.0, 1.2), DVec3::NEG_X);
    assert_eq!(predict(&scene, &away, None), None);
}

#[test]
fn failure_the_object_is_occluded() {
    // A small panel hides the wall that the hand moves to: the panel is predicted.
    let panel = front(0.6, [-0.1, 0.1], [1.2, 1.5]);
    let scene = plain_scene(&[("wall", wall(1.0)), ("panel", panel)]);
    let state = hand(DVec3::new(0.5, -0.6, 1.2), DVec3::X);
    let p = predict(&scene, &state, Some(gaze_at(DVec3::new(1.0, 0.0, 1.2)))).unwrap();
    assert_eq!((p.source, p.surface), (Gaze, found(&scene, "panel")));
    // The edge of the panel is closest.
    assert_close!(p.point_m, DVec3::new(0.6, -0.1, 1.2), Tol::abs(1e-12));
    // The motion alone would have found the wall.
    let p = predict(&scene, &state, None).unwrap();
    assert_eq!(p.surface, found(&scene, "wall"));
}

#[test]
fn failure_the_hand_is_already_behind_the_surface() {
    let gaze = Some(gaze_at(DVec3::new(1.0, 0.0, 1.2)));
    // A sheet, and a slab of 10 cm with its back nearer to the hand.
    let [a, b, c, d] = wall(1.1);
    let back = [b, a, d, c];
    let sheet = plain_scene(&[("wall", wall(1.0))]);
    let mut obj = String::from("o wall\n");
    for [x, y, z] in wall(1.0).into_iter().chain(back) {
        obj += &format!("v {x} {y} {z}\n");
    }
    obj += "f 1 2 3 4\nf 5 6 7 8\n";
    let (slab, _) = Scene::from_obj_str(&obj, None).unwrap();
    for scene in [&sheet, &slab] {
        for velocity in [DVec3::X, DVec3::NEG_X] {
            let p = predict(scene, &hand(DVec3::new(1.08, 0.1, 1.3), velocity), gaze).unwrap();
            // The board stays on the person's side.
            assert_close!(p.normal, DVec3::NEG_X, Tol::abs(1e-12));
            assert_close!(p.point_m, DVec3::new(1.0, 0.1, 1.3), Tol::abs(1e-12));
            assert_close!(p.distance_m, -0.08, Tol::abs(1e-12));
            assert_eq!(p.time_to_contact_s.map(|t| t.mean_s), Some(0.0));
        }
    }
    // Without gaze the person's side is unknown: the back is taken for the front.
    let behind = hand(DVec3::new(1.08, 0.1, 1.3), DVec3::NEG_X);
    let p = predict(&sheet, &behind, None).unwrap();
    assert_close!(p.normal, DVec3::X, Tol::abs(1e-12));
}

#[test]
fn failure_two_surfaces_meet_in_a_corner() {
    let side = side(1.0, [-1.0, 1.0], [0.0, 2.0]);
    let scene = plain_scene(&[("front", wall(1.0)), ("side", side)]);
    let state = hand(DVec3::new(0.8, 0.9, 1.2), DVec3::new(0.5, 0.5, 0.0));
    // One millimetre of gaze decides; the point jumps around the corner with it.
    let front = predict(&scene, &state, Some(gaze_at(DVec3::new(1.0, 0.999, 1.2)))).unwrap();
    let beside = predict(&scene, &state, Some(gaze_at(DVec3::new(0.999, 1.0, 1.2)))).unwrap();
    let surfaces = [front.surface, beside.surface];
    assert_eq!(surfaces, ["front", "side"].map(|name| found(&scene, name)));
    assert_close!(front.point_m, DVec3::new(1.0, 0.9, 1.2), Tol::abs(1e-12));
    assert_close!(beside.point_m, DVec3::new(0.8, 1.0, 1.2), Tol::abs(1e-12));
    assert_close!(front.normal, DVec3::NEG_X, Tol::abs(1e-12));
    assert_close!(beside.normal, DVec3::NEG_Y, Tol::abs(1e-12));
    assert_close!(due_s(&front), 0.4, Tol::abs(1e-12));
    assert_close!(due_s(&beside), 0.2, Tol::abs(1e-12));
}

#[test]
fn an_untouchable_surface_that_is_gazed_at_is_not_predicted() {
    let sidecar = "[surface.glass]\nkind = \"untouchable\"\n";
    let scene = scene(&[("wall", wall(1.0)), ("glass", wall(0.9))], Some(sidecar));
    let gaze = Some(gaze_at(DVec3::new(1.0, 0.0, 1.2)));
    let glass = scene.find("glass");
    // The glass also blocks the path of the hand, so only the distance can decide.
    let p = predict(&scene, &hand(DVec3::new(0.8, 0.0, 1.2), DVec3::X), gaze).unwrap();
    assert_ne!(Some(p.surface), glass);
    assert_eq!(p.source, PredictionSource::Nearest);
    let afar = hand(DVec3::new(0.2, 0.0, 1.2), DVec3::X);
    assert_eq!(predict(&scene, &afar, gaze), None);
}

#[test]
fn a_far_wall_that_is_gazed_at_does_not_hide_a_panel_under_the_hand() {
    let panel = front(0.6, [-0.9, -0.3], [1.0, 1.5]);
    let scene = plain_scene(&[("far", wall(4.0)), ("panel", panel)]);
    let state = hand(DVec3::new(0.3, -0.6, 1.2), DVec3::X * 0.5);
    let p = predict(&scene, &state, Some(gaze_at(DVec3::new(4.0, 0.0, 1.2)))).unwrap();
    let panel = found(&scene, "panel");
    assert_eq!((p.source, p.surface), (HandDirection, panel));
}

#[test]
fn bad_numbers_predict_nothing_or_are_refused() {
    let scene = plain_scene(&[("wall", wall(1.0))]);
    let good = hand(DVec3::new(0.4, 0.1, 1.2), DVec3::X);
    let nan = hand(DVec3::new(f64::NAN, 0.1, 1.2), DVec3::X);
    assert_eq!(predict(&scene, &nan, None), None);
    for (origin_m, direction) in [(DVec3::NAN, DVec3::X), (HEAD, DVec3::ZERO)] {
        let no_gaze = GazeRay {
            origin_m,
            direction,
        };
        let p = predict(&scene, &good, Some(no_gaze)).unwrap();
        assert_eq!(p.source, HandDirection);
    }
    let config = DeterministicConfig {
        max_distance_m: f64::NAN,
        ..DeterministicConfig::default()
    };
    assert!(DeterministicPredictor::new(config).is_err());
}

#[test]
fn random_hands_and_walls_agree_with_the_plane() {
    // The truth is known: a large wall anywhere, a hand in front of it, a gaze at it.
    let mut sampler = Sampler::new(12);
    for _ in 0..200 {
        let (turn, middle) = (sampler.rotation(), sampler.unit_vector() * 2.0);
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[u, v]| (middle + turn * DVec3::new(4.0 * u, 4.0 * v, 0.0)).to_array());
        let scene = plain_scene(&[("wall", corners)]);
        let side = turn.z_axis * if sampler.bool() { 1.0 } else { -1.0 };
        let inside =
            |s: &mut Sampler| turn * DVec3::new(s.uniform(-2.0, 2.0), s.uniform(-2.0, 2.0), 0.0);
        let foot = middle + inside(&mut sampler);
        let (height, speed) = (sampler.uniform(0.05, 1.0), sampler.uniform(0.1, 2.0));
        let along = turn * DVec3::new(sampler.normal(), sampler.normal(), 0.0) * 0.1;
        let state = hand(foot + side * height, along - side * speed);
        let eye = foot + side * (height + 0.3) + along;
        let gaze = GazeRay {
            origin_m: eye,
            direction: (middle + inside(&mut sampler) - eye).normalize(),
        };
        let p = predict(&scene, &state, Some(gaze)).unwrap();
        assert_eq!(p.source, Gaze);
        assert_close!(p.point_m, foot, Tol::abs(1e-9));
        assert_close!(p.normal, side, Tol::abs(1e-9));
        assert_close!(p.distance_m, height, Tol::abs(1e-9));
        assert_close!(due_s(&p), height / speed, Tol::new(1e-9, 1e-9));
    }
}

fn predict_led(scene: &Scene, hand: &HandState, gaze: Option<GazeRay>) -> ContactPrediction {
    let mut predictor = DeterministicPredictor::new(DeterministicConfig::ray_led()).unwrap();
    predict_with(&mut predictor, scene, hand, gaze).unwrap()
}

#[test]
fn led_by_the_ray_the_point_is_where_the_gaze_rests_until_the_hand_is_near() {
    let scene = plain_scene(&[("wall", wall(1.0))]);
    let seen = DVec3::new(1.0, -0.4, 1.0);
    let state = hand(DVec3::new(0.4, 0.1, 1.2), DVec3::X);
    let far = predict_led(&scene, &state, Some(gaze_at(seen)));
    assert_close!(far.point_m, seen, Tol::abs(1e-9));
    assert_close!(far.normal, DVec3::NEG_X, Tol::abs(1e-12));
    // Distance and time are still those of the hand.
    assert_close!(far.distance_m, 0.6, Tol::abs(1e-12));
    assert_close!(due_s(&far), 0.6, Tol::abs(1e-12));
    // Within 0.02 m the hand decides, halfway to 0.06 m the hand and the ray do.
    let resting = |distance: f64| hand(DVec3::new(1.0 - distance, 0.1, 1.2), DVec3::ZERO);
    let near = predict_led(&scene, &resting(0.015), Some(gaze_at(seen)));
    assert_close!(near.point_m, DVec3::new(1.0, 0.1, 1.2), Tol::abs(1e-12));
    let between = predict_led(&scene, &resting(0.04), Some(gaze_at(seen)));
    assert_close!(between.point_m, DVec3::new(1.0, -0.15, 1.1), Tol::abs(1e-9));
}

#[test]
fn led_by_the_ray_a_hand_at_a_slant_meets_the_wall_where_its_motion_leads() {
    let scene = plain_scene(&[("wall", wall(1.0))]);
    let slanted = hand(DVec3::new(0.9, 0.1, 1.2), DVec3::new(0.5, 0.5, 0.0));
    // Without gaze the ray is the hand's direction of motion.
    let led = predict_led(&scene, &slanted, None);
    assert_eq!(led.source, HandDirection);
    assert_close!(led.point_m, DVec3::new(1.0, 0.2, 1.2), Tol::abs(1e-9));
    // The same near the wall, for any gaze.
    let close = hand(DVec3::new(0.985, 0.1, 1.2), DVec3::new(0.5, 0.5, 0.0));
    let led = predict_led(&scene, &close, Some(gaze_at(DVec3::new(1.0, -0.4, 1.0))));
    assert_close!(led.point_m, DVec3::new(1.0, 0.115, 1.2), Tol::abs(1e-9));
}
