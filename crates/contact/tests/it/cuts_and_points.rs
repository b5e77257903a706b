//! Reaches with external segmentation, and named points of the arm.

use crate::common::check_all;
use crate::learned::reaches_of;
use glam::DVec3;
use hwall_contact::{ContactEstimator, LearnedConfig, LearnedModel};
use hwall_hand::{BodyPoint, HandFrame, HandPoint, LabelledReach};
use hwall_testkit::{Sampler, minimum_jerk};
use std::sync::LazyLock;

const PERIOD_S: f64 = 1.0 / 90.0;

/// Reaches with the index tip alone; the elbow moves to where the hand will end, in half the time.
fn reaches(seed: u64, people: usize, each: usize) -> Vec<LabelledReach> {
    reaches_of(seed, (people, each), |sampler, tau, [from, to, tip_m]| {
        let mut frame = HandFrame::empty(0.0);
        let tip_m = tip_m + 5e-4 * sampler.normal_vector();
        frame.set_point(HandPoint::Index, Some(tip_m));
        let elbow_m = from.lerp(to, 0.5 * minimum_jerk(2.0 * tau)) + DVec3::X * 0.4;
        let elbow_m = elbow_m + 5e-4 * sampler.normal_vector();
        frame.set_body(BodyPoint::Elbow, Some(elbow_m));
        frame
    })
}

fn without_elbow(mut all: Vec<LabelledReach>) -> Vec<LabelledReach> {
    let frames = all.iter_mut().flat_map(|r| &mut r.frames);
    frames.for_each(|f| f.set_body(BodyPoint::Elbow, None));
    all
}

/// The reach with a rest before it, and with tremor of the hand.
fn rested(mut reach: LabelledReach, rest_s: f64, sampler: &mut Sampler) -> LabelledReach {
    let first = reach.frames[0];
    let count = (rest_s / PERIOD_S) as usize;
    let rest = (1..=count).rev().map(|k| {
        let mut frame = first;
        frame.t_s = first.t_s - k as f64 * PERIOD_S;
        for point in HandPoint::ALL {
            let place_m = first.point(point);
            frame.set_point(point, place_m.map(|p| p + 5e-4 * sampler.normal_vector()));
        }
        frame
    });
    reach.frames = rest.chain(reach.frames.iter().copied()).collect();
    reach
}

/// The reach without its first part.
fn late(mut reach: LabelledReach, share: f64) -> LabelledReach {
    let from_s = share * reach.contact_s;
    reach.frames.retain(|f| f.t_s >= from_s);
    reach
}

/// Mean error and share within the 90 % regions at a share of the true time of each reach.
fn judged(model: &LearnedModel, test: &[LabelledReach], share: f64) -> (f64, f64) {
    let (mut miss_m, mut held) = (0.0, 0.0);
    for reach in test {
        let mut estimator = model.estimator();
        estimator.begin();
        let until_s = share * reach.contact_s + 1e-9;
        let seen = reach.frames.iter().take_while(|f| f.t_s <= until_s);
        let last = seen.filter_map(|f| estimator.step(f)).last();
        let last = last.expect("tracked");
        miss_m += last.point_m.distance(reach.contact_m);
        held += f64::from(last.distance_squared(reach.contact_m).expect("learnt") <= 6.251);
    }
    let n = test.len() as f64;
    (miss_m / n, held / n)
}

fn mean_error_m(model: &LearnedModel, test: &[LabelledReach], share: f64) -> f64 {
    judged(model, test, share).0
}

fn trained(known: &[LabelledReach]) -> LearnedModel {
    LearnedModel::train(known, &LearnedConfig::default()).expect("good reaches")
}

static MODEL: LazyLock<LearnedModel> = LazyLock::new(|| trained(&without_elbow(reaches(1, 4, 15))));
/// A model that knows the elbow.
static FULL: LazyLock<LearnedModel> = LazyLock::new(|| trained(&reaches(31, 6, 10)));

#[test]
fn a_rest_before_the_reach_and_a_late_cut_change_little() {
    let test = without_elbow(reaches(2, 3, 10));
    let mut sampler = Sampler::new(5);
    let rested = test.iter().map(|r| rested(r.clone(), 0.9, &mut sampler));
    let rested: Vec<_> = rested.collect();
    let late: Vec<_> = test.iter().map(|r| late(r.clone(), 0.15)).collect();
    for share in [0.4, 0.5, 0.7, 0.9] {
        let errors_m = [&test, &rested, &late].map(|t| mean_error_m(&MODEL, t, share));
        let [whole_m, rested_m, late_m] = errors_m;
        assert!(rested_m < 1.1 * whole_m + 1e-3, "{share}: {errors_m:?}");
        assert!(late_m < 1.5 * whole_m + 5e-3, "{share}: {errors_m:?}");
    }
}

#[test]
fn what_was_learnt_from_reaches_with_rests_is_as_good() {
    let mut sampler = Sampler::new(6);
    let known = without_elbow(reaches(1, 4, 15)).into_iter().map(|r| {
        let rest_s = sampler.uniform(0.0, 1.5);
        rested(r, rest_s, &mut sampler)
    });
    let model = trained(&known.collect::<Vec<_>>());
    let test = without_elbow(reaches(2, 3, 10));
    for share in [0.5, 0.7, 0.9] {
        let [plain_m, rests_m] = [&*MODEL, &model].map(|m| mean_error_m(m, &test, share));
        let most_m = 1.2 * plain_m + 2e-3;
        assert!(rests_m < most_m, "{share}: {rests_m} of {most_m} m");
    }
}

#[test]
fn a_point_of_the_arm_is_used_where_it_tells_more_and_may_come_and_go() {
    let model = trained(&reaches(1, 4, 15));
    let test = reaches(2, 3, 10);
    let alone_m = mean_error_m(&MODEL, &without_elbow(test.clone()), 0.3);
    let helped_m = mean_error_m(&model, &test, 0.3);
    assert!(helped_m < 0.8 * alone_m, "{alone_m} {helped_m}");
    // The point is lost, found, NaN and gone for good: estimates never stop or become invalid.
    let mut estimator = model.estimator();
    for reach in &test {
        estimator.begin();
        for (k, frame) in reach.frames.iter().enumerate() {
            let mut frame = *frame;
            match k % 7 {
                0 | 1 => frame.set_body(BodyPoint::Elbow, None),
                2 => frame.set_body(BodyPoint::Elbow, Some(DVec3::NAN)),
                3 => frame.set_body(BodyPoint::Shoulder, Some(DVec3::INFINITY)),
                _ => {}
            }
            check_all(&estimator.step(&frame).expect("the hand is seen"));
        }
    }
}

#[test]
fn where_a_decisive_point_stays_away_the_others_answer_less_sure() {
    let never = trained(&without_elbow(reaches(31, 6, 10)));
    let seen = reaches(32, 8, 10);
    let away = without_elbow(seen.clone());
    for share in [0.3, 0.5, 0.7, 0.9] {
        let (without_m, held) = judged(&FULL, &away, share);
        assert!((0.8..=1.0).contains(&held), "{share}: {held}");
        let most_m = 1.3 * mean_error_m(&never, &away, share) + 1e-3;
        assert!(without_m < most_m, "{share}: {without_m} of {most_m} m");
    }
    // The point is decisive.
    assert!(mean_error_m(&FULL, &seen, 0.5) < 0.6 * mean_error_m(&FULL, &away, 0.5));
}

/// Everything is 5 cm further to the side than in training, and touches are reported when the next reach may already have begun.
#[test]
fn a_touch_teaches_the_model_that_answered() {
    let off_m = DVec3::Y * 0.05;
    let (seen, test) = (reaches(34, 1, 12), reaches(35, 2, 10));
    let miss_m = |estimator: &hwall_contact::LearnedEstimator, test: &[LabelledReach]| {
        let misses = test.iter().map(|reach| {
            let mut estimator = estimator.clone();
            estimator.begin();
            let seen = (reach.frames.iter()).take_while(|f| f.t_s <= 0.7 * reach.contact_s);
            let last = seen.filter_map(|f| estimator.step(f)).last();
            let off_m = reach.contact_m + off_m - last.expect("tracked").point_m;
            off_m.y.abs()
        });
        misses.sum::<f64>() / test.len() as f64
    };
    for away in [true, false] {
        let of = |all: &[LabelledReach], away: bool| {
            let all = all.to_vec();
            if away { without_elbow(all) } else { all }
        };
        let mut estimator = FULL.estimator();
        let before = [true, false].map(|away| miss_m(&estimator, &of(&test, away)));
        for reach in of(&seen, away) {
            estimator.begin();
            for frame in &reach.frames {
                estimator.step(frame);
            }
            assert!(estimator.begin_tentatively());
            for frame in &reach.frames[..3] {
                estimator.step(frame);
            }
            estimator.touched(reach.contact_m + off_m, reach.contact_s);
        }
        assert_eq!(estimator.touches(), seen.len());
        let after = [true, false].map(|away| miss_m(&estimator, &of(&test, away)));
        let (own, other) = if away { (0, 1) } else { (1, 0) };
        assert!(after[own] < 0.7 * before[own]);
        assert!((after[other] - before[other]).abs() < 0.1 * before[other]);
    }
}

#[test]
fn a_decisive_point_that_comes_late_or_goes_is_used_while_it_is_known() {
    let seen = reaches(33, 6, 10);
    let hidden = |from: f64, to: f64| {
        let mut all = seen.clone();
        for reach in &mut all {
            let contact_s = reach.contact_s;
            let gone = |f: &&mut HandFrame| (from..to).contains(&(f.t_s / contact_s));
            let frames = reach.frames.iter_mut().filter(gone);
            frames.for_each(|f| f.set_body(BodyPoint::Elbow, None));
        }
        all
    };
    let whole_m = mean_error_m(&FULL, &seen, 0.7);
    // The samples before the cut are unknown, so the regions are somewhat too small: 72 %.
    for (from, to) in [(0.0, 0.03), (0.0, 0.35), (0.2, 0.25), (0.4, 0.5)] {
        let (now_m, held) = judged(&FULL, &hidden(from, to), 0.7);
        assert!(now_m < 1.6 * whole_m + 2e-3 && held > 0.65);
    }
    // A dropout of a few frames at the start does not switch to the smaller model.
    let mut estimator = FULL.estimator();
    for reach in hidden(0.0, 0.05) {
        estimator.begin();
        let mut all = reach.frames.iter().map(|f| estimator.step(f));
        assert!(all.all(|e| e.is_some_and(|e| e.point_m.is_finite())));
    }
}
