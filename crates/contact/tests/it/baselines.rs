//! Baseline estimators: exact where they should be, and always with an estimate.

use crate::common::check;
use glam::DVec3;
use hwall_contact::{
    ConstantVelocity, ContactError, ContactEstimate, ContactEstimator, Hold, MinimumJerk,
    NearestNeighbour, RidgeWindow,
};
use hwall_hand::{HandError, HandFrame, HandPoint, LabelledReach};
use hwall_testkit::{Sampler, minimum_jerk};

type Trained = Box<dyn ContactEstimator>;

/// A reach along a curve parametrised by the share of its time, sampled at uneven times, as trackers drop frames. The palm is 0.1 m behind the
/// index tip.
fn reach(duration_s: f64, curve: impl Fn(f64) -> DVec3) -> LabelledReach {
    let mut times = vec![3.0];
    while times[times.len() - 1] + 0.02 < 3.0 + duration_s {
        let step = if times.len() % 3 == 0 { 0.02 } else { 0.01 };
        times.push(times[times.len() - 1] + step);
    }
    times.push(3.0 + duration_s);
    let frames = times.iter().map(|&t_s| {
        let mut frame = HandFrame::empty(t_s);
        let tip_m = curve((t_s - 3.0) / duration_s);
        frame.set_point(HandPoint::Index, Some(tip_m));
        frame.set_point(HandPoint::Palm, Some(tip_m - DVec3::new(0.1, 0.0, 0.0)));
        frame
    });
    let (frames, contact_s) = (frames.collect(), 3.0 + duration_s);
    LabelledReach::new(HandPoint::Index, frames, curve(1.0), contact_s)
}

/// Minimum-jerk reaches of 0.4 m and 0.8 s from about one place into a half space.
fn reaches(count: usize, seed: u64) -> Vec<LabelledReach> {
    let mut sampler = Sampler::new(seed);
    let reaches = (0..count).map(|_| {
        let from = sampler.point_in_box(DVec3::splat(-0.02), DVec3::splat(0.02));
        let way = sampler.unit_vector();
        let way = 0.4 * DVec3::new(way.x.abs(), way.y, way.z);
        reach(0.8, |tau| from + minimum_jerk(tau) * way)
    });
    reaches.collect()
}

fn all(reaches: &[LabelledReach]) -> Vec<(&'static str, Result<Trained, ContactError>)> {
    macro_rules! boxed {
        ($e:ident) => {
            $e::train(reaches).map(|e| Box::new(e) as Trained)
        };
    }
    vec![
        ("hold", boxed!(Hold)),
        ("constant velocity", boxed!(ConstantVelocity)),
        ("minimum jerk", boxed!(MinimumJerk)),
        ("nearest", boxed!(NearestNeighbour)),
        ("ridge", boxed!(RidgeWindow)),
    ]
}

fn trained(reaches: &[LabelledReach]) -> Vec<(&'static str, Trained)> {
    let trained = all(reaches).into_iter();
    trained.map(|(name, e)| (name, e.unwrap())).collect()
}

/// The estimate after a share of the time.
fn after(
    estimator: &mut dyn ContactEstimator,
    reach: &LabelledReach,
    share: f64,
) -> ContactEstimate {
    estimator.begin();
    let until_s = reach.frames[0].t_s + share * reach.duration_s() + 1e-9;
    let seen = reach.frames.iter().filter(|f| f.t_s <= until_s);
    seen.map(|f| estimator.step(f)).last().flatten().unwrap()
}

#[test]
fn constant_velocity_is_exact_on_a_uniform_motion_of_known_duration() {
    let (from, way) = (DVec3::new(0.1, -0.2, 1.0), DVec3::new(0.7, 0.1, -0.4));
    let line = reach(0.9, |tau| from + tau * way);
    let mut estimator = ConstantVelocity::train(std::slice::from_ref(&line)).unwrap();
    for share in [0.05, 0.4, 0.8, 1.0] {
        let estimate = after(&mut estimator, &line, share);
        assert!(estimate.point_m.distance(line.contact_m) < 1e-12, "{share}");
        let left_s = line.contact_s - estimate.t_s;
        assert!((estimate.time_to_contact_s.unwrap().mean_s - left_s).abs() < 1e-12);
    }
    // A single frame has no velocity; a hand that is late is predicted to stay where it is.
    estimator.begin();
    let first = estimator.step(&line.frames[0]).unwrap();
    assert_eq!(first.point_m, from);
    let mut late = line.frames[line.frames.len() - 1];
    late.t_s += 1.0;
    late.set_point(HandPoint::Index, Some(DVec3::X));
    assert_eq!(estimator.step(&late).unwrap().point_m, DVec3::X);
}

#[test]
fn arrival_is_that_of_the_reaches_that_last_longer() {
    let curve = |tau: f64| tau * DVec3::X;
    let training = [reach(0.5, curve), reach(0.7, curve), reach(0.9, curve)];
    let mut estimator = Hold::train(&training).unwrap();
    let left = |estimator: &mut Hold, share| {
        let estimate = after(estimator, &training[2], share);
        (estimate.t_s - 3.0, estimate.time_to_contact_s.unwrap())
    };
    let (t_s, early) = left(&mut estimator, 0.1);
    assert!((early.mean_s - (0.7 - t_s)).abs() < 1e-12);
    assert!((early.sd_s.unwrap() - 0.2).abs() < 1e-12);
    let (t_s, late) = left(&mut estimator, 0.7);
    assert!((late.mean_s - (0.8 - t_s)).abs() < 1e-12);
    assert_eq!(left(&mut estimator, 1.0).1.mean_s, 0.0);
}

#[test]
fn minimum_jerk_is_exact_on_a_minimum_jerk_motion() {
    let training = reaches(12, 1);
    let mut estimator = MinimumJerk::train(&training).unwrap();
    for reach in reaches(5, 2) {
        for share in [0.3, 0.5, 0.8, 1.0] {
            let estimate = after(&mut estimator, &reach, share);
            let off_m = estimate.point_m.distance(reach.contact_m);
            assert!(off_m < 1e-3, "{share}: {off_m}");
            let left_s = estimate.time_to_contact_s.unwrap().mean_s;
            let off_s = left_s - (reach.contact_s - estimate.t_s);
            assert!(off_s.abs() < 5e-3, "{share}: {off_s}");
        }
    }
    // Longer and slower than any training reach: the samples outweigh the prior.
    let unusual = reach(1.0, |tau| minimum_jerk(tau) * DVec3::new(0.4, 0.3, 0.1));
    let estimate = after(&mut estimator, &unusual, 0.7);
    assert!(estimate.point_m.distance(unusual.contact_m) < 0.02);
}

#[test]
fn nearest_neighbours_find_the_demonstrations_of_the_same_kind() {
    // Five paths, five demonstrations each, from other starts and at other times.
    let aslant = DVec3::new(0.5, 0.5, 0.0);
    let ways = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_Y, aslant];
    let mut sampler = Sampler::new(3);
    let mut of = |way: DVec3| {
        let from = sampler.point_in_box(DVec3::splat(-0.3), DVec3::splat(0.3));
        reach(0.8, |tau| from + minimum_jerk(tau) * way)
    };
    let training: Vec<LabelledReach> = (0..25).map(|k| of(ways[k / 5])).collect();
    let mut estimator = NearestNeighbour::train(&training).unwrap();
    for way in ways {
        let reach = of(way);
        for share in [0.3, 0.6, 1.0] {
            let estimate = after(&mut estimator, &reach, share);
            // Demonstrations are resampled at regular times, by linear interpolation.
            assert!(estimate.point_m.distance(reach.contact_m) < 2e-3, "{share}");
            check("nearest", &estimate);
        }
    }
}

#[test]
fn demonstrations_that_are_over_rest_where_they_ended() {
    let way = |duration_s: f64, end: DVec3| reach(duration_s, move |tau| minimum_jerk(tau) * end);
    let (near, far) = (DVec3::new(0.2, 0.0, 0.0), DVec3::new(0.4, 0.1, 0.0));
    // Both demonstrations count, with the shorter one first or last.
    let (short, long) = (way(0.4, near), way(0.8, far));
    for training in [[short.clone(), long.clone()], [long.clone(), short]] {
        let mut estimator = NearestNeighbour::train(&training).unwrap();
        estimator.begin();
        for frame in &long.frames {
            let estimate = estimator.step(frame).unwrap();
            let now_m = frame.point(HandPoint::Index).unwrap();
            if frame.t_s > 3.45 {
                // The near demonstration has ended, the far one still has its whole displacement left.
                let expected_m = now_m + 0.5 * (far - now_m);
                let off_m = estimate.point_m.distance(expected_m);
                assert!(off_m < 1e-3, "{off_m} m at {} s", frame.t_s);
            }
        }
    }
}

#[test]
fn ridge_finds_an_end_that_is_linear_in_what_was_seen() {
    let training = reaches(60, 4);
    let mut estimator = RidgeWindow::train(&training).unwrap();
    for reach in &reaches(6, 5) {
        let estimate = after(&mut estimator, reach, 0.5);
        let off_m = estimate.point_m.distance(reach.contact_m);
        assert!(off_m < 5e-3, "{off_m}");
        let c = estimate.covariance_m2.unwrap();
        assert!(c.x_axis.x.sqrt() < 5e-3, "{c}");
    }
}

#[test]
fn ridge_states_the_error_on_people_it_has_not_met() {
    // All people overshoot the motion, each by a personal amount.
    let mut sampler = Sampler::new(6);
    let sd = DVec3::new(0.02, 0.05, 0.01);
    let mut all: Vec<LabelledReach> = Vec::new();
    for person in 0..24 {
        let own_m = sd * sampler.normal_vector();
        for mut reach in reaches(6, 100 + person) {
            reach.person = Some(person.to_string());
            reach.contact_m += own_m;
            all.push(reach);
        }
    }
    let mut estimator = RidgeWindow::train(&all).unwrap();
    let estimate = after(&mut estimator, &all[0], 0.5);
    let c = estimate.covariance_m2.unwrap();
    let stated = DVec3::new(c.x_axis.x, c.y_axis.y, c.z_axis.z).map(f64::sqrt);
    // With 24 people, the standard deviation is known to about a seventh.
    let ratio = (stated / sd).to_array();
    assert!(ratio.iter().all(|r| (0.6..1.6).contains(r)), "{ratio:?}");
}

#[test]
fn a_missing_finger_is_bridged_by_the_palm() {
    let training = reaches(30, 7);
    let whole = &reaches(1, 8)[0];
    let without = |gone: fn(usize) -> bool| {
        let mut reach = whole.clone();
        let frames = reach.frames.iter_mut().enumerate();
        let gone = frames.filter(|(k, _)| gone(*k));
        gone.for_each(|(_, frame)| frame.set_point(HandPoint::Index, None));
        reach
    };
    let (gaps, none) = (without(|k| k % 4 != 0), without(|_| true));
    for (name, mut estimator) in trained(&training) {
        for share in [0.0, 0.4, 1.0] {
            let expected = after(&mut *estimator, whole, share);
            // The palm keeps its distance and is equally informative; if the finger was never seen, the distance from training is used.
            for other in [&gaps, &none] {
                let estimate = after(&mut *estimator, other, share);
                let off_m = estimate.point_m.distance(expected.point_m);
                assert!(off_m < 1e-6, "{name} at {share}");
            }
        }
    }
}

#[test]
fn frames_that_bring_nothing_change_nothing_but_the_clock() {
    let training = reaches(30, 9);
    let reach = &reaches(1, 10)[0];
    let half = reach.frames.len() / 2;
    for (name, mut estimator) in trained(&training) {
        estimator.begin();
        assert_eq!(estimator.step(&HandFrame::empty(2.9)), None, "{name}");
        estimator.begin();
        let mut before = None;
        for frame in &reach.frames[..half] {
            before = estimator.step(frame);
        }
        let before = before.unwrap();
        // The same frame again, an older one, one without a time, one without a usable number.
        let mut timeless = reach.frames[half];
        timeless.t_s = f64::NAN;
        for frame in [reach.frames[half - 1], reach.frames[0], timeless] {
            assert_eq!(estimator.step(&frame), Some(before), "{name}");
        }
        let mut blind = HandFrame::empty(before.t_s + 0.05);
        blind.set_point(HandPoint::Index, Some(DVec3::splat(f64::NAN)));
        let held = estimator.step(&blind).unwrap();
        assert_eq!(held.point_m, before.point_m, "{name}");
        assert_eq!(held.t_s, before.t_s + 0.05, "{name}");
        let [left_s, before_s] = [held, before].map(|e| e.time_to_contact_s.unwrap().mean_s);
        let off_s = left_s - (before_s - 0.05).max(0.0);
        assert!(off_s.abs() < 1e-12, "{name}");
    }
}

#[test]
fn a_new_reach_forgets_the_one_before() {
    let training = reaches(30, 11);
    let two = reaches(2, 12);
    let pairs = trained(&training).into_iter().zip(trained(&training));
    for ((name, mut used), (_, fresh)) in pairs {
        after(&mut *used, &two[0], 1.0);
        let again = [used, fresh].map(|mut e| after(&mut *e, &two[1], 0.6));
        assert_eq!(again[0], again[1], "{name}");
    }
}

#[test]
fn no_input_makes_a_number_that_is_none() {
    let training = reaches(30, 13);
    let far = |x: f64| Some(DVec3::new(x, -x, x));
    let mut sampler = Sampler::new(14);
    for (name, mut estimator) in trained(&training) {
        for case in 0..40 {
            estimator.begin();
            let mut t_s = sampler.uniform(-1e3, 1e3);
            for _ in 0..60 {
                t_s += match case % 4 {
                    0 => 0.01,
                    1 => 1e-12,
                    2 => sampler.uniform(-0.01, 0.03),
                    _ => 10f64.powf(sampler.uniform(-9.0, 300.0)),
                };
                let mut frame = HandFrame::empty(t_s);
                for point in [HandPoint::Index, HandPoint::Palm, HandPoint::Little] {
                    let place_m = match sampler.index(6) {
                        0 => None,
                        1 => far(f64::NAN),
                        2 => far(1e300),
                        3 => far(1e6),
                        _ => Some(sampler.unit_vector()),
                    };
                    frame.set_point(point, place_m);
                }
                if let Some(estimate) = estimator.step(&frame) {
                    check(name, &estimate);
                }
            }
        }
    }
}

#[test]
fn too_little_to_learn_from_is_an_error_or_enough() {
    for (name, estimator) in all(&[]) {
        let refused = matches!(estimator, Err(ContactError::TooFewReaches { got: 0, .. }));
        assert!(refused, "{name}");
    }
    let one = reaches(1, 15);
    for (name, estimator) in all(&one) {
        match estimator {
            Ok(mut estimator) => check(name, &after(&mut *estimator, &one[0], 0.5)),
            Err(error) => {
                let expected = ContactError::TooFewReaches { got: 1, needed: 8 };
                assert_eq!((name, error), ("ridge", expected));
            }
        }
    }
    // Eight identical reaches: no feature is informative, and nothing is divided by zero.
    let same = vec![one[0].clone(); 8];
    for (name, mut estimator) in trained(&same) {
        check(name, &after(&mut *estimator, &one[0], 0.5));
    }
}

#[test]
fn reaches_that_do_not_fit_together_are_refused() {
    let mut broken = reaches(10, 16);
    broken[3].contact_m.x = f64::NAN;
    let mut mixed = reaches(10, 16);
    mixed[3].point = HandPoint::Palm;
    for training in [broken, mixed] {
        for (name, estimator) in all(&training) {
            let refused = matches!(estimator, Err(ContactError::Hand(HandError::Reach { .. })));
            assert!(refused, "{name}");
        }
    }
}
