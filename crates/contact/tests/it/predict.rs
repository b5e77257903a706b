//! Deterministic prediction: what it must get right, and its known failures.

use crate::common::{fixed, scene};
use glam::DVec3;
use hwall_contact::{
    ContactPrediction, DeterministicConfig, DeterministicPredictor, PredictionSource, Predictor,
    PredictorInput, RayLead,
};
use hwall_hand::{GazeRay, HandFilter, HandFilterConfig, HandFrame, HandPoint, HandState};
use hwall_scene::Scene;
use hwall_testkit::{Sampler, Tol, assert_close};

/// A wall at a given x, seen from smaller x, spanning y from -1 to 1 and z from 0 to 2.
fn wall(x: f64) -> [[f64; 3]; 4] {
    [[x, 1.0, 0.0], [x, -1.0, 0.0], [x, -1.0, 2.0], [x, 1.0, 2.0]]
}

fn hand(point_m: DVec3, velocity_m_per_s: DVec3) -> HandState {
    HandState {
        t_s: 0.0,
        point: HandPoint::Index,
        point_m,
        velocity_m_per_s,
        direction: velocity_m_per_s.try_normalize(),
        smoothed_m: [point_m; 2],
        delay_s: 0.0,
        unseen_s: 0.0,
        palm_m: None,
    }
}

const HEAD: DVec3 = DVec3::new(-0.2, 0.0, 1.6);

fn gaze_at(target_m: DVec3) -> GazeRay {
    GazeRay {
        origin_m: HEAD,
        direction: (target_m - HEAD).normalize(),
    }
}

fn predict(scene: &Scene, hand: &HandState, gaze: Option<GazeRay>) -> Option<ContactPrediction> {
    predict_with(&mut DeterministicPredictor::default(), scene, hand, gaze)
}

fn predict_with(
    predictor: &mut DeterministicPredictor,
    scene: &Scene,
    hand: &HandState,
    gaze: Option<GazeRay>,
) -> Option<ContactPrediction> {
    let seen = PredictorInput {
        frame: &HandFrame::empty(hand.t_s),
        hand: Some(hand),
        gaze: fixed(hand.t_s, gaze),
    };
    predictor.predict(scene, &seen).first().copied()
}

#[test]
fn the_hand_is_projected_on_the_wall_that_is_gazed_at() {
    let scene = scene(&[("wall", wall(1.0))], None);
    let state = hand(DVec3::new(0.4, 0.1, 1.2), DVec3::new(0.5, 0.3, 0.0));
    let p = predict(&scene, &state, Some(gaze_at(DVec3::new(1.0, -0.4, 1.0)))).unwrap();
    assert_eq!(
        (p.source, Some(p.surface)),
        (PredictionSource::Gaze, scene.find("wall"))
    );
    assert_close!(p.point_m, DVec3::new(1.0, 0.1, 1.2), Tol::abs(1e-12));
    assert_close!(p.normal, DVec3::NEG_X, Tol::abs(1e-12));
    assert_close!(p.distance_m, 0.6, Tol::abs(1e-12));
    assert_close!(
        p.time_to_contact_s.unwrap().mean_s,
        0.6 / 0.5,
        Tol::abs(1e-12)
    );
}

#[test]
fn a_receding_or_resting_hand_has_no_time_to_contact() {
    let scene = scene(&[("wall", wall(1.0))], None);
    let gaze = Some(gaze_at(DVec3::new(1.0, 0.0, 1.0)));
    for velocity in [DVec3::NEG_X, DVec3::Y, DVec3::ZERO, DVec3::X * 0.01] {
        let p = predict(&scene, &hand(DVec3::new(0.4, 0.0, 1.2), velocity), gaze).unwrap();
        assert_eq!(
            (p.source, p.time_to_contact_s),
            (PredictionSource::Gaze, None),
            "{velocity}"
        );
    }
}

#[test]
fn a_hand_on_the_wall_touches_now() {
    let scene = scene(&[("wall", wall(1.0))], None);
    let state = hand(DVec3::new(1.0, 0.0, 1.2), DVec3::X);
    let p = predict(&scene, &state, Some(gaze_at(DVec3::new(1.0, 0.0, 1.0)))).unwrap();
    assert_close!(p.distance_m, 0.0, Tol::abs(1e-9));
    assert_eq!(p.time_to_contact_s.map(|t| t.mean_s), Some(0.0));
}

#[test]
fn failure_gaze_misses_the_object() {
    let scene = scene(&[("wall", wall(1.0))], None);
    let past = Some(GazeRay {
        origin_m: HEAD,
        direction: DVec3::Z,
    });
    let approaching = hand(DVec3::new(0.0, 0.1, 1.2), DVec3::new(1.0, 0.2, 0.0));
    let p = predict(&scene, &approaching, past).unwrap();
    assert_eq!(p.source, PredictionSource::HandDirection);
    assert_close!(p.point_m, DVec3::new(1.0, 0.1, 1.2), Tol::abs(1e-12));
    // Neither gaze nor direction: only what is close by.
    let idle = |x: f64| hand(DVec3::new(x, 0.1, 1.2), DVec3::ZERO);
    assert_eq!(predict(&scene, &idle(0.0), past), None);
    assert_eq!(
        predict(&scene, &idle(0.8), past).unwrap().source,
        PredictionSource::Nearest
    );
    assert_eq!(
        predict(&scene, &hand(DVec3::new(0.0, 0.0, 1.2), DVec3::NEG_X), None),
        None
    );
}

#[test]
fn failure_the_object_is_occluded() {
    // A small panel hides the wall that the hand moves to: the panel is predicted.
    let panel = [
        [0.6, 0.1, 1.2],
        [0.6, -0.1, 1.2],
        [0.6, -0.1, 1.5],
        [0.6, 0.1, 1.5],
    ];
    let scene = scene(&[("wall", wall(1.0)), ("panel", panel)], None);
    let state = hand(DVec3::new(0.5, -0.6, 1.2), DVec3::X);
    let p = predict(&scene, &state, Some(gaze_at(DVec3::new(1.0, 0.0, 1.2)))).unwrap();
    assert_eq!(
        (p.source, Some(p.surface)),
        (PredictionSource::Gaze, scene.find("panel"))
    );
    assert_close!(
        p.point_m,
        DVec3::new(0.6, -0.1, 1.2),
        Tol::abs(1e-12),
        "its edge is closest"
    );
    // The motion alone would have shown it.
    assert_eq!(
        Some(predict(&scene, &state, None).unwrap().surface),
        scene.find("wall")
    );
}

#[test]
fn failure_the_hand_is_already_behind_the_surface() {
    let gaze = Some(gaze_at(DVec3::new(1.0, 0.0, 1.2)));
    // A sheet, and a slab of 10 cm whose back the hand is nearer to.
    let back = [
        [1.1, -1.0, 0.0],
        [1.1, 1.0, 0.0],
        [1.1, 1.0, 2.0],
        [1.1, -1.0, 2.0],
    ];
    let sheet = scene(&[("wall", wall(1.0))], None);
    let mut obj = String::from("o wall\n");
    for [x, y, z] in wall(1.0).into_iter().chain(back) {
        obj += &format!("v {x} {y} {z}\n");
    }
    let slab = Scene::from_obj_str(&(obj + "f 1 2 3 4\nf 5 6 7 8\n"), None)
        .unwrap()
        .0;
    for scene in [&sheet, &slab] {
        for velocity in [DVec3::X, DVec3::NEG_X] {
            let p = predict(scene, &hand(DVec3::new(1.08, 0.1, 1.3), velocity), gaze).unwrap();
            assert_close!(
                p.normal,
                DVec3::NEG_X,
                Tol::abs(1e-12),
                "the board stays on the person's side"
            );
            assert_close!(p.point_m, DVec3::new(1.0, 0.1, 1.3), Tol::abs(1e-12));
            assert_close!(p.distance_m, -0.08, Tol::abs(1e-12));
            assert_eq!(p.time_to_contact_s.map(|t| t.mean_s), Some(0.0));
        }
    }
    // Without a gaze nobody knows where the person stands: the back is taken for the front.
    let p = predict(
        &sheet,
        &hand(DVec3::new(1.08, 0.1, 1.3), DVec3::NEG_X),
        None,
    )
    .unwrap();
    assert_close!(p.normal, DVec3::X, Tol::abs(1e-12));
}

#[test]
fn failure_two_surfaces_meet_in_a_corner() {
    let side = [
        [-1.0, 1.0, 0.0],
        [1.0, 1.0, 0.0],
        [1.0, 1.0, 2.0],
        [-1.0, 1.0, 2.0],
    ];
    let scene = scene(&[("front", wall(1.0)), ("side", side)], None);
    let state = hand(DVec3::new(0.8, 0.9, 1.2), DVec3::new(0.5, 0.5, 0.0));
    // One millimetre of gaze decides; the point leaps around the corner with it.
    let front = predict(&scene, &state, Some(gaze_at(DVec3::new(1.0, 0.999, 1.2)))).unwrap();
    let beside = predict(&scene, &state, Some(gaze_at(DVec3::new(0.999, 1.0, 1.2)))).unwrap();
    assert_eq!(
        [Some(front.surface), Some(beside.surface)],
        [scene.find("front"), scene.find("side")]
    );
    assert_close!(front.point_m, DVec3::new(1.0, 0.9, 1.2), Tol::abs(1e-12));
    assert_close!(beside.point_m, DVec3::new(0.8, 1.0, 1.2), Tol::abs(1e-12));
    assert_close!(front.normal, DVec3::NEG_X, Tol::abs(1e-12));
    assert_close!(beside.normal, DVec3::NEG_Y, Tol::abs(1e-12));
    assert_close!(
        front.time_to_contact_s.unwrap().mean_s,
        0.4,
        Tol::abs(1e-12)
    );
    assert_close!(
        beside.time_to_contact_s.unwrap().mean_s,
        0.2,
        Tol::abs(1e-12)
    );
}

#[test]
fn an_untouchable_surface_that_is_gazed_at_is_not_predicted() {
    let sidecar = "[surface.glass]\nkind = \"untouchable\"\n";
    let scene = scene(&[("wall", wall(1.0)), ("glass", wall(0.9))], Some(sidecar));
    let gaze = Some(gaze_at(DVec3::new(1.0, 0.0, 1.2)));
    let glass = scene.find("glass");
    // The glass also blocks the way of the hand, so only nearness is left.
    let p = predict(&scene, &hand(DVec3::new(0.8, 0.0, 1.2), DVec3::X), gaze).unwrap();
    assert_ne!(Some(p.surface), glass);
    assert_eq!(p.source, PredictionSource::Nearest);
    assert_eq!(
        predict(&scene, &hand(DVec3::new(0.2, 0.0, 1.2), DVec3::X), gaze),
        None
    );
}

#[test]
fn a_far_wall_that_is_gazed_at_does_not_hide_a_panel_under_the_hand() {
    let panel = [
        [0.6, -0.3, 1.0],
        [0.6, -0.9, 1.0],
        [0.6, -0.9, 1.5],
        [0.6, -0.3, 1.5],
    ];
    let scene = scene(&[("far", wall(4.0)), ("panel", panel)], None);
    let state = hand(DVec3::new(0.3, -0.6, 1.2), DVec3::X * 0.5);
    let p = predict(&scene, &state, Some(gaze_at(DVec3::new(4.0, 0.0, 1.2)))).unwrap();
    assert_eq!(
        (p.source, Some(p.surface)),
        (PredictionSource::HandDirection, scene.find("panel"))
    );
}

#[test]
fn bad_numbers_predict_nothing_or_are_refused() {
    let scene = scene(&[("wall", wall(1.0))], None);
    let good = hand(DVec3::new(0.4, 0.1, 1.2), DVec3::X);
    let nan = hand(DVec3::new(f64::NAN, 0.1, 1.2), DVec3::X);
    assert_eq!(predict(&scene, &nan, None), None);
    let bad_gaze = GazeRay {
        origin_m: DVec3::NAN,
        direction: DVec3::X,
    };
    assert_eq!(
        predict(&scene, &good, Some(bad_gaze)).unwrap().source,
        PredictionSource::HandDirection
    );
    let no_gaze = GazeRay {
        origin_m: HEAD,
        direction: DVec3::ZERO,
    };
    assert_eq!(
        predict(&scene, &good, Some(no_gaze)).unwrap().source,
        PredictionSource::HandDirection
    );
    let config = DeterministicConfig {
        max_distance_m: f64::NAN,
        ..DeterministicConfig::default()
    };
    assert!(DeterministicPredictor::new(config).is_err());
}

#[test]
fn random_hands_and_walls_agree_with_the_plane() {
    // Planted truth: a large wall anywhere, a hand before it, a gaze at it.
    let mut sampler = Sampler::new(12);
    for _ in 0..200 {
        let (turn, middle) = (sampler.rotation(), sampler.unit_vector() * 2.0);
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[u, v]| (middle + turn * DVec3::new(4.0 * u, 4.0 * v, 0.0)).to_array());
        let scene = scene(&[("wall", corners)], None);
        let side = if sampler.bool() {
            turn.z_axis
        } else {
            -turn.z_axis
        };
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
        assert_eq!(p.source, PredictionSource::Gaze);
        assert_close!(p.point_m, foot, Tol::abs(1e-9));
        assert_close!(p.normal, side, Tol::abs(1e-9));
        assert_close!(
            p.time_to_contact_s.unwrap().mean_s,
            height / speed,
            Tol::new(1e-9, 1e-9)
        );
    }
}

#[test]
fn a_simulated_reach_is_predicted_before_it_arrives() {
    let scene = scene(&[("wall", wall(1.0))], None);
    let mut filter = HandFilter::new(HandFilterConfig::simulated()).unwrap();
    let mut predictor = DeterministicPredictor::default();
    let (start, target) = (DVec3::new(0.4, -0.1, 1.1), DVec3::new(1.0, 0.15, 1.3));
    let mut errors = Vec::new();
    for i in 0..=60 {
        let t_s = 0.014 * f64::from(i);
        let s = t_s / 0.84;
        let index = start.lerp(target, s * s * s * (10.0 - 15.0 * s + 6.0 * s * s));
        let mut frame = HandFrame {
            head_m: Some(HEAD),
            ..HandFrame::empty(t_s)
        };
        frame.gaze = Some(gaze_at(target).direction);
        frame.tips_m[1] = Some(index);
        if let Some(hand) = filter.step(&frame).state() {
            let p = predict_with(&mut predictor, &scene, hand, frame.gaze_ray()).unwrap();
            assert_eq!(p.source, PredictionSource::Gaze);
            let time_s = p.time_to_contact_s.map(|t| t.mean_s);
            errors.push((s, p.point_m.distance(target), time_s));
        }
    }
    let at = |share: f64| *errors.iter().find(|e| e.0 >= share).unwrap();
    for share in [0.3, 0.5, 0.7, 0.9] {
        println!(
            "{:.0} %: off by {:.1} mm, contact in {:?} s",
            share * 100.0,
            at(share).1 * 1e3,
            at(share).2
        );
    }
    // The projection is off by the part of the way along the wall that is still to go.
    assert!(at(0.5).1 < 0.20 && at(0.9).1 < 0.01);
}

fn predict_led(scene: &Scene, hand: &HandState, gaze: Option<GazeRay>) -> ContactPrediction {
    let mut predictor = DeterministicPredictor::new(DeterministicConfig::ray_led()).unwrap();
    predict_with(&mut predictor, scene, hand, gaze).unwrap()
}

#[test]
fn led_by_the_ray_the_point_is_where_the_gaze_rests_until_the_hand_is_near() {
    let scene = scene(&[("wall", wall(1.0))], None);
    let seen = DVec3::new(1.0, -0.4, 1.0);
    let far = predict_led(
        &scene,
        &hand(DVec3::new(0.4, 0.1, 1.2), DVec3::X),
        Some(gaze_at(seen)),
    );
    assert_close!(far.point_m, seen, Tol::abs(1e-9));
    assert_close!(far.normal, DVec3::NEG_X, Tol::abs(1e-12));
    // Distance and time stay those of the hand.
    assert_close!(far.distance_m, 0.6, Tol::abs(1e-12));
    assert_close!(far.time_to_contact_s.unwrap().mean_s, 0.6, Tol::abs(1e-12));
    // Within 0.02 m the hand decides, half way to 0.06 m both.
    let resting = |distance: f64| hand(DVec3::new(1.0 - distance, 0.1, 1.2), DVec3::ZERO);
    let near = predict_led(&scene, &resting(0.015), Some(gaze_at(seen)));
    assert_close!(near.point_m, DVec3::new(1.0, 0.1, 1.2), Tol::abs(1e-12));
    let between = predict_led(&scene, &resting(0.04), Some(gaze_at(seen)));
    assert_close!(between.point_m, DVec3::new(1.0, -0.15, 1.1), Tol::abs(1e-9));
}

#[test]
fn led_by_the_ray_a_hand_at_a_slant_meets_the_wall_where_its_motion_leads() {
    let scene = scene(&[("wall", wall(1.0))], None);
    let slanted = hand(DVec3::new(0.9, 0.1, 1.2), DVec3::new(0.5, 0.5, 0.0));
    // Without a gaze the ray is the hand's own direction.
    let led = predict_led(&scene, &slanted, None);
    assert_eq!(led.source, PredictionSource::HandDirection);
    assert_close!(led.point_m, DVec3::new(1.0, 0.2, 1.2), Tol::abs(1e-9));
    // Near the wall, too, whatever the gaze says.
    let close = hand(DVec3::new(0.985, 0.1, 1.2), DVec3::new(0.5, 0.5, 0.0));
    let led = predict_led(&scene, &close, Some(gaze_at(DVec3::new(1.0, -0.4, 1.0))));
    assert_close!(led.point_m, DVec3::new(1.0, 0.115, 1.2), Tol::abs(1e-9));
}

#[test]
fn leading_distances_must_rise_from_a_positive_one() {
    for [near_m, far_m] in [
        [0.0, 0.1],
        [0.1, 0.1],
        [0.2, 0.1],
        [f64::NAN, 0.1],
        [0.1, f64::NAN],
    ] {
        let config = DeterministicConfig {
            ray_lead: Some(RayLead { near_m, far_m }),
            ..DeterministicConfig::default()
        };
        assert!(
            DeterministicPredictor::new(config).is_err(),
            "{near_m} {far_m}"
        );
    }
}
