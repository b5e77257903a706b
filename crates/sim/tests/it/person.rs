//! The simulated person: timing, contact, gaze, hand, noise, determinism.

use crate::common::{self, height};
use glam::DVec3;
use hwall_sim::{
    Gesture, Person, PersonConfig, PersonSample, SimError, TouchPlan, TouchSequence, minimum_jerk,
};
use hwall_testkit::{Tol, assert_close};

/// Walls, slanted panels and shelf tops in front of the default person.
fn plan(seed: u64, count: usize) -> Vec<TouchPlan> {
    let box_m = [DVec3::new(0.5, -0.4, 0.3), DVec3::new(0.7, 0.4, 0.65)];
    common::touches_in(box_m, true, seed, count)
}

fn person(seed: u64) -> Person {
    Person::new(PersonConfig::default(), seed).expect("valid")
}

fn sequence(seed: u64, count: usize) -> TouchSequence {
    person(seed).plan(&plan(seed, count)).expect("within reach")
}

#[test]
fn minimum_jerk_peaks_at_1_875_times_distance_over_time() {
    let at = [-1.0, 0.0, 0.5, 1.0, 7.0].map(minimum_jerk);
    assert_eq!(at, [0.0, 0.0, 0.5, 1.0, 1.0]);
    assert!(minimum_jerk(f64::NAN).is_nan());

    // A straight reach perpendicular to the surface is one such movement.
    let config = PersonConfig {
        curvature: [0.0; 2],
        tremor_m: [0.0; 2],
        ..PersonConfig::default()
    };
    for seed in 0..20 {
        let person = Person::new(config, seed).unwrap();
        let target_m = config.hand_rest_m - DVec3::X * 0.4;
        let normal = DVec3::X * 3.0;
        let sequence = person.plan(&[TouchPlan { target_m, normal }]).unwrap();
        let touch = sequence.touches()[0];
        let reach_s = touch.press_s - touch.start_s;
        let speed = |i| {
            let t_s = touch.start_s + reach_s * f64::from(i) / 1000.0;
            sequence.true_index_velocity_m_per_s(t_s).length()
        };
        let peak = (0..=1000).map(speed).fold(0.0, f64::max);
        let expected = 1.875 * (0.4 + touch.depth_m) / reach_s;
        assert_close!(peak, expected, Tol::rel(1e-6));
    }
}

#[test]
fn same_seed_same_sequence_and_another_seed_another_person() {
    let times = || (0..3000).map(|i| f64::from(i) * 0.0137);
    let all = |seed| {
        let sequence = person(seed).plan(&plan(0, 10)).unwrap();
        let samples = times().map(|t_s| sequence.sample(t_s));
        samples.collect::<Vec<PersonSample>>()
    };
    assert_eq!(all(5), all(5));
    assert_ne!(all(5), all(6));
    assert_ne!(person(5).mean_reach_s(), person(6).mean_reach_s());
    assert_ne!(person(5).hand_length_m(), person(6).hand_length_m());

    // The results are the same in any order.
    let sequence = person(5).plan(&plan(0, 10)).unwrap();
    for (t_s, sample) in times().zip(all(5)).collect::<Vec<_>>().into_iter().rev() {
        assert_eq!(sequence.sample(t_s), sample, "{t_s} s");
    }
    // Earlier touches do not depend on later ones.
    let shorter = person(5).plan(&plan(0, 10)[..4]).unwrap();
    assert_eq!(shorter.touches(), &sequence.touches()[..4]);
}

#[test]
fn tracker_noise_has_the_configured_deviation_and_is_white() {
    let sequence = sequence(3, 5);
    let n = 20_000;
    let noise = |i: u32| {
        let t_s = f64::from(i) / 90.0;
        let (measured, truth) = (sequence.sample(t_s), sequence.truth(t_s));
        [
            measured.palm_m - truth.palm_m,
            measured.tips_m[0] - truth.tips_m[0],
            measured.tips_m[1] - truth.tips_m[1],
            measured.tips_m[4] - truth.tips_m[4],
            measured.head_m - truth.head_m,
        ]
    };
    let samples: Vec<[DVec3; 5]> = (0..n).map(noise).collect();
    for point in 0..5 {
        let mean = samples.iter().map(|s| s[point]).sum::<DVec3>() / f64::from(n);
        let variance = samples.iter().map(|s| s[point] * s[point]).sum::<DVec3>() / f64::from(n);
        let pairs = samples.windows(2).map(|w| w[0][point] * w[1][point]);
        let neighbours = pairs.sum::<DVec3>() / f64::from(n);
        assert!(mean.abs().max_element() < 3e-5, "{mean}");
        for axis in 0..3 {
            assert_close!(variance[axis].sqrt(), 0.7e-3, Tol::rel(0.03));
            assert!(neighbours[axis].abs() < 0.04 * variance[axis]);
        }
    }
    let cross = samples.iter().map(|s| s[0] * s[1]).sum::<DVec3>() / f64::from(n);
    assert!(cross.abs().max_element() < 0.04 * 0.49e-6);
}

#[test]
fn tremor_has_its_amplitude_and_frequency_at_rest() {
    let sequence = person(2).plan(&[]).unwrap();
    let rest_m = PersonConfig::default().hand_rest_m;
    let offset = |i: u32| sequence.true_index_tip(f64::from(i) * 1e-3) - rest_m;
    let offsets: Vec<DVec3> = (0..10_000).map(offset).collect();
    let furthest = offsets.iter().map(|o| o.length()).fold(0.0, f64::max);
    assert!((0.2e-3..=0.3e-3 + 1e-12).contains(&furthest), "{furthest}");
    for axis in 0..3 {
        let crossings = offsets
            .windows(2)
            .filter(|w| w[0][axis] * w[1][axis] < 0.0)
            .count();
        // 10 s with two crossings per period.
        assert!((158..=242).contains(&crossings), "{crossings}");
    }
}

#[test]
fn the_hand_is_whole_and_moves_without_jumps() {
    for gesture in Gesture::ALL {
        let config = PersonConfig {
            gesture: Some(gesture),
            ..PersonConfig::default()
        };
        for seed in 0..20 {
            let person = Person::new(config, seed).unwrap();
            let sequence = person.plan(&plan(seed, 5)).unwrap();
            let mut last = sequence.truth(0.0);
            let steps = (sequence.duration_s() / 1e-3) as u32 + 500;
            for i in 1..steps {
                let truth = sequence.truth(f64::from(i) * 1e-3);
                let size = person.hand_length_m();
                assert_eq!(truth.tips_m[1], sequence.true_index_tip(truth.t_s));
                assert_close!(truth.gaze.length(), 1.0, Tol::abs(1e-12));
                for (tip_m, last_m) in truth.tips_m.iter().zip(last.tips_m) {
                    assert!(tip_m.distance(truth.palm_m) < 0.65 * size);
                    let moved_m = tip_m.distance(last_m);
                    assert!(moved_m < 5e-3, "{moved_m} m in 1 ms");
                }
                last = truth;
            }
            for touch in sequence.touches() {
                let truth = sequence.truth(touch.contact_s);
                let outside = |&tip_m: &DVec3| height(touch, tip_m) > -1e-9;
                assert!(truth.tips_m.iter().all(outside));
                assert!(height(touch, truth.palm_m) > 0.0);
            }
        }
    }
}

#[test]
fn the_path_is_bowed_slightly() {
    for seed in 0..50 {
        let sequence = sequence(seed, 5);
        for touch in sequence.touches() {
            let from = sequence.true_index_tip(touch.start_s);
            let way = touch.target_m - from;
            let deviation = |i| {
                let t_s = touch.start_s + (touch.contact_s - touch.start_s) * f64::from(i) / 100.0;
                let gone = sequence.true_index_tip(t_s) - from;
                gone.cross(way.normalize()).length() / way.length()
            };
            let largest = (0..=100).map(deviation).fold(0.0, f64::max);
            assert!((0.002..0.2).contains(&largest), "{largest}");
        }
    }
}

#[test]
fn the_head_is_where_it_was_put_and_above_the_shoulder() {
    let person = person(0);
    let sequence = person.plan(&[]).unwrap();
    for i in 0..1000 {
        let head_m = sequence.truth(f64::from(i) * 0.1).head_m;
        assert!(head_m.distance(DVec3::new(1.3, 0.0, 1.0)) < 6e-3);
    }
    // Facing -x, the right shoulder is at +y.
    let shoulder_m = DVec3::new(1.3, 0.2, 0.7);
    assert_close!(person.shoulder_m(), shoulder_m, Tol::abs(1e-12));
}

#[test]
fn nan_in_gives_nan_out_and_times_beyond_the_sequence_are_rest() {
    let sequence = sequence(1, 2);
    for t_s in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let sample = sequence.sample(t_s);
        assert!(sample.tips_m[1].is_nan() && sample.palm_m.is_nan() && sample.gaze.is_nan());
        assert!(sample.head_m.is_nan());
        assert!(sequence.true_index_tip(t_s).is_nan());
        assert!(sequence.true_index_velocity_m_per_s(t_s).is_nan());
    }
    for t_s in [-1e9, -1.0, sequence.duration_s() + 1.0, 1e9] {
        let tip_m = sequence.true_index_tip(t_s);
        assert!(tip_m.distance(PersonConfig::default().hand_rest_m) < 0.31e-3);
    }
}

#[test]
fn impossible_plans_are_errors_that_name_the_touch() {
    let good = plan(0, 1)[0];
    let behind = TouchPlan {
        target_m: DVec3::new(1.2, 0.0, 0.5),
        normal: DVec3::X,
    };
    let refused = person(0).plan(&[good, behind]).unwrap_err();
    assert!(matches!(refused, SimError::BehindSurface { touch: 1, .. }));
    for (target_m, normal) in [
        (DVec3::NAN, good.normal),
        (good.target_m, DVec3::NAN),
        (good.target_m, DVec3::ZERO),
        (good.target_m, DVec3::splat(f64::MAX)),
        (DVec3::splat(-f64::MAX), good.normal),
    ] {
        let bad = TouchPlan { target_m, normal };
        assert!(person(0).plan(&[bad]).is_err(), "{bad:?}");
    }
}
