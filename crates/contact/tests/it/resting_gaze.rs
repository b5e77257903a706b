//! Effect of fixations while a hand rests or moves on, and during saccades.

use crate::common::{
    self, EYE, Fused, ball, blurred, front, fused, gaze_at, hand as hand_at, plain_scene, see, side,
};
use crate::gaze_evidence::Vague;
use glam::DVec3;
use hwall_contact::*;
use hwall_hand::{Fixation, Gaze, GazeRay, HandFrame};
use hwall_scene::Scene;
use hwall_testkit::{Sampler, Tol, assert_close};

const REST: DVec3 = DVec3::new(0.0, 0.0, 1.2);

/// A wall, with a door next to it that is seen at a slant.
fn with_a_door() -> Scene {
    plain_scene(&[
        ("wall", front(0.7, [-1.0, 0.45], [0.0, 2.0])),
        ("door", side(0.45, [0.0, 0.7], [0.0, 2.0])),
    ])
}

#[test]
fn a_hand_at_rest_does_not_hold_the_prediction() {
    let scene = with_a_door();
    // The hand rests near the wall, the eyes land on the door.
    let hand = (DVec3::new(0.4, -0.2, 1.2), DVec3::ZERO);
    let target_m = DVec3::new(0.3, 0.45, 1.1);
    let mut fused = fused();
    for _ in 0..50 {
        let gaze = Some(gaze_at(EYE, DVec3::new(0.7, -0.2, 1.4)));
        let p = fused.see(&scene, hand, None, gaze)[0];
        assert_eq!(Some(p.surface), scene.find("wall"));
    }
    for _ in 0..20 {
        let p = fused.see(&scene, hand, None, Some(gaze_at(EYE, target_m)))[0];
        assert_eq!(Some(p.surface), scene.find("door"));
        assert_eq!(p.source, PredictionSource::Gaze);
        assert!(p.looked_at_since_s.is_some());
        assert!(p.point_m.distance(target_m) < 0.03, "{}", p.point_m);
    }
}

#[test]
fn the_error_of_a_look_is_that_of_each_direction_of_the_surface() {
    let scene = with_a_door();
    let target_m = DVec3::new(0.3, 0.45, EYE.z);
    let gaze = gaze_at(EYE, target_m);
    let hand = hand_at(0.0, REST, DVec3::ZERO);
    let mut led = ray_led();
    let p = see(&mut led, &scene, &hand, fixed(0.0, gaze))[0];
    let c = p.covariance_m2.unwrap();
    let slope = gaze.direction.y.abs();
    let across_m = 0.03 * target_m.distance(EYE);
    assert_close!(c.z_axis.z.sqrt(), across_m, Tol::new(0.0, 0.02));
    assert_close!(c.x_axis.x.sqrt(), across_m / slope, Tol::new(0.0, 0.02));
    assert!(c.y_axis.y.sqrt() < 0.002);
    // The dissertation's projection of the hand has no covariance.
    let mut plain = DeterministicPredictor::default();
    let p = see(&mut plain, &scene, &hand, fixed(0.0, gaze))[0];
    assert_eq!(p.covariance_m2, None);
}

#[test]
fn regions_of_points_led_by_the_gaze_hold_what_they_say() {
    let scene = with_a_door();
    let mut sampler = Sampler::new(31);
    let hand = hand_at(0.0, REST, DVec3::ZERO);
    let mut led = ray_led();
    let (mut inside, mut all) = (0.0, 0.0);
    for _ in 0..2000 {
        let target_m = DVec3::new(sampler.uniform(0.2, 0.5), 0.45, sampler.uniform(0.9, 1.5));
        let exact = gaze_at(EYE, target_m);
        let direction = blurred(&mut sampler, exact.direction, 0.03);
        let gaze = fixed(0.0, GazeRay { direction, ..exact });
        let p = see(&mut led, &scene, &hand, gaze)[0];
        if Some(p.surface) == scene.find("door") {
            let squared = p.squared_deviations(target_m).unwrap();
            inside += f64::from(squared <= 2.0 * 10_f64.ln());
            all += 1.0;
        }
    }
    let share = inside / all;
    assert!(all > 1500.0 && (0.86..0.94).contains(&share), "{share}");
}

fn ray_led() -> DeterministicPredictor {
    DeterministicPredictor::new(DeterministicConfig::ray_led()).unwrap()
}

fn fixed(t_s: f64, ray: GazeRay) -> Gaze {
    common::fixed(t_s, Some(ray))
}

#[test]
fn in_flight_and_lost_for_a_moment_the_last_prediction_holds() {
    let scene = with_a_door();
    let target_m = DVec3::new(0.3, 0.45, 1.1);
    let mut led = ray_led();
    let mut fused = FusedPredictor::new(Vague, FusedConfig::default()).unwrap();
    let both: [&mut dyn Predictor; 2] = [&mut led, &mut fused];
    for predictor in both {
        let mut at = |t_s: f64, gaze: Gaze| {
            // At rest near the wall, with noise towards it.
            let hand = hand_at(t_s, DVec3::new(0.5, -0.2, 1.2), DVec3::X * 0.06);
            see(&mut *predictor, &scene, &hand, gaze).first().copied()
        };
        let dwell = |t_s: f64| Gaze::Fixed(Fixation::of_ray(0.0, t_s, gaze_at(EYE, target_m)));
        let mut before = None;
        for i in 0..40 {
            let t_s = 0.01 * f64::from(i);
            before = at(t_s, dwell(t_s));
        }
        let before = before.unwrap();
        assert_eq!(Some(before.surface), scene.find("door"));
        // A saccade, then a blink, then the gaze returns: no prediction moves.
        for i in 40..65 {
            let t_s = 0.01 * f64::from(i);
            let gaze = match i < 48 {
                true => Gaze::InFlight { since_s: 0.4 },
                false => Gaze::Lost,
            };
            let p = at(t_s, gaze).unwrap();
            assert_eq!(p.surface, before.surface, "{t_s}");
            assert_close!(p.point_m, before.point_m, Tol::abs(0.01));
        }
        let p = at(0.66, dwell(0.66)).unwrap();
        assert_close!(p.point_m, before.point_m, Tol::abs(0.01));
        assert_eq!(p.looked_at_since_s, Some(0.0));
        // After a longer loss the gaze is no longer used.
        let mut last = None;
        for i in 67..200 {
            last = at(0.01 * f64::from(i), Gaze::Lost);
        }
        assert_eq!(last.unwrap().looked_at_since_s, None);
    }
}

/// Reports its number of training reaches.
#[derive(Debug, Clone, Copy)]
struct LearntFrom(usize);

impl ContactEstimator for LearntFrom {
    fn begin(&mut self) {}

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        Vague.step(frame)
    }

    fn training_reaches(&self) -> Option<usize> {
        Some(self.0)
    }
}

#[test]
fn where_too_little_was_learnt_the_ray_leads() {
    let scene = with_a_door();
    let config = FusedConfig::default();
    let needed = config.least_reaches;
    let mut few = FusedPredictor::new(LearntFrom(10), config.clone()).unwrap();
    let enough = FusedPredictor::new(LearntFrom(needed), config).unwrap();
    let reaches = 10;
    assert_eq!(few.experience(), Experience::TooLittle { reaches, needed });
    assert_eq!(enough.experience(), Experience::Enough);
    let mut led = ray_led();
    for i in 0..80 {
        let t_s = 0.01 * f64::from(i);
        let hand = hand_at(t_s, REST + DVec3::X * 0.005 * f64::from(i), DVec3::X * 0.5);
        let gaze = fixed(t_s, gaze_at(EYE, DVec3::new(0.3, 0.45, 1.1)));
        let by_ray = see(&mut led, &scene, &hand, gaze).to_vec();
        assert_eq!(see(&mut few, &scene, &hand, gaze), by_ray);
    }
}

#[test]
fn without_a_gaze_a_fingertip_past_the_wall_touches_it_from_its_own_side() {
    let scene = plain_scene(&[
        ("wall", common::WALL),
        ("next room", front(1.2, [-1.0, 1.0], [0.0, 2.0])),
    ]);
    let mut led = ray_led();
    for i in 0..60 {
        let x = 0.5 + 0.004 * f64::from(i);
        let hand = hand_at(0.01 * f64::from(i), DVec3::new(x, 0.0, 1.2), DVec3::X * 0.4);
        let p = see(&mut led, &scene, &hand, Gaze::Lost)[0];
        assert_eq!(Some(p.surface), scene.find("wall"), "{x}");
        assert_close!(p.normal, DVec3::NEG_X, Tol::abs(1e-12));
        assert_close!(p.distance_m, 0.7 - x, Tol::abs(1e-9));
        if x > 0.7 {
            assert_eq!(p.time_to_contact_s.map(|t| t.mean_s), Some(0.0));
        }
    }
}

#[test]
fn a_look_that_begins_on_the_way_can_change_the_goal() {
    // If half of the training people look elsewhere while they reach, the prediction follows a
    // change of mind.
    let mut config = FusedConfig::default();
    let agrees = [0.0, 0.9, 0.05, 0.0, 0.0, 0.05];
    let disagrees = [0.3, 0.0, 0.7, 0.0, 0.0, 0.0];
    config
        .evidence
        .set_shares(ReachPhase::UnderWay, [agrees, disagrees]);
    let scene = with_a_door();
    let (first_m, second_m) = (DVec3::new(0.7, -0.2, 1.2), DVec3::new(0.3, 0.45, 1.1));
    let mut fused = Fused::new(config);
    let estimate = Some((first_m, ball(0.08)));
    let way = |i: u32| (DVec3::new(0.006 * f64::from(i), 0.0, 1.2), DVec3::X * 0.6);
    for i in 0..50 {
        let p = fused.see(&scene, way(i), estimate, Some(gaze_at(EYE, first_m)))[0];
        assert_eq!(Some(p.surface), scene.find("wall"));
    }
    // From the first sample of the new fixation on, although the hand still moves to the old target.
    for i in 50..55 {
        let looks_s = fused.now_s() + 0.01;
        let gaze = Gaze::Fixed(Fixation::of_ray(0.5, looks_s, gaze_at(EYE, second_m)));
        let p = fused.see_with(&scene, way(i), estimate, gaze)[0];
        assert_eq!(Some(p.surface), scene.find("door"), "{i}");
        assert!(p.point_m.distance(second_m) < 0.05);
    }
}
