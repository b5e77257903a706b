//! Adaptation of the learned estimator to a person's touches.

use crate::learned::{follow, reaches};
use glam::DVec3;
use hwall_contact::{ContactEstimator, LearnedConfig, LearnedModel};
use hwall_hand::{HandPoint, LabelledReach};
use hwall_testkit::Sampler;
use std::ops::Range;
use std::sync::OnceLock;

/// Some people are fast first and others at the end, consistently: the same hand has more distance and time left in one case than in the other.
#[test]
fn what_is_a_persons_own_is_learnt_from_touches() {
    let of_person = |seed: u64, each: usize| -> Vec<LabelledReach> {
        let mut made = reaches(seed, 1, each);
        let skew = Sampler::new(seed).uniform(0.6, 1.7);
        for reach in &mut made {
            let whole_s = reach.contact_s;
            let each = reach.frames.iter_mut();
            each.for_each(|f| f.t_s = whole_s * (f.t_s / whole_s).powf(skew));
            reach.person = Some(format!("of seed {seed}"));
        }
        made
    };
    let known: Vec<LabelledReach> = (100..112).flat_map(|seed| of_person(seed, 12)).collect();
    let model = LearnedModel::train(&known, &LearnedConfig::default()).expect("good reaches");
    let mut sums = [[0.0; 2]; 2];
    for seed in 200..216 {
        let made = of_person(seed, 20);
        for (told, sums) in sums.iter_mut().enumerate() {
            let mut estimator = model.estimator();
            for (k, reach) in made.iter().enumerate() {
                let all = follow(&mut estimator, &reach.frames);
                let half = all[all.len() / 2];
                let left = half.time_to_contact_s.expect("learnt");
                if k >= 10 {
                    sums[0] += half.point_m.distance(reach.contact_m);
                    sums[1] += (half.t_s + left.mean_s - reach.contact_s).abs();
                }
                if told == 1 {
                    estimator.touched(reach.contact_m, reach.contact_s);
                }
            }
        }
    }
    let [[point_m, time_s], [told_m, told_s]] = sums.map(|s| s.map(|s| s / 160.0));
    assert!(told_m < 0.85 * point_m, "{point_m} {told_m}");
    assert!(told_s < time_s, "{time_s} {told_s}");
}

/// Reaches of people who each curve to one side: up, down, left or right. The same first half leads to different ends.
fn bowed(seed: u64, each: usize, size: f64) -> Vec<LabelledReach> {
    let mut made = reaches(seed, 1, each);
    let mut sampler = Sampler::new(seed);
    let bow_m = DVec3::new(0.0, sampler.normal(), sampler.normal()) * (0.05 * size);
    for reach in &mut made {
        let whole_s = reach.contact_s;
        for frame in &mut reach.frames {
            let tau = frame.t_s / whole_s;
            let aside_m = bow_m * (4.0 * tau * (1.0 - tau)).powi(3);
            for point in [HandPoint::Index, HandPoint::Palm] {
                let at_m = frame.point(point).expect("tracked");
                frame.set_point(point, Some(at_m + aside_m));
            }
        }
        reach.person = Some(format!("of seed {seed}"));
    }
    made
}

/// The model of twelve people with such curvature, trained once for all tests.
fn model_of_bows() -> &'static LearnedModel {
    static MODEL: OnceLock<LearnedModel> = OnceLock::new();
    MODEL.get_or_init(|| {
        let known = (100..112).flat_map(|seed| bowed(seed, 12, 1.0));
        let known: Vec<LabelledReach> = known.collect();
        LearnedModel::train(&known, &LearnedConfig::default()).expect("good reaches")
    })
}

/// From the 20th touch on all contacts are 8 cm to the side of the apparent target, as after a tracker was moved.
#[test]
fn a_room_that_has_moved_is_followed_at_all_times_left() {
    let model = model_of_bows();
    const SHARES: [f64; 3] = [0.35, 0.5, 0.8];
    let mean_m = |moved_m: f64, touches: Range<usize>| -> [f64; 3] {
        let mut sums = [0.0; 3];
        for seed in 200..210 {
            let to = Sampler::new(seed).normal_vector().normalize() * moved_m;
            let mut estimator = model.estimator();
            for (k, reach) in bowed(seed, 40, 1.0).iter().enumerate() {
                let contact_m = reach.contact_m + if k >= 20 { to } else { DVec3::ZERO };
                let all = follow(&mut estimator, &reach.frames);
                if touches.contains(&k) {
                    let count = 10.0 * touches.len() as f64;
                    for (sum, share) in sums.iter_mut().zip(SHARES) {
                        let said = all[(share * (all.len() - 1) as f64) as usize];
                        *sum += said.point_m.distance(contact_m) / count;
                    }
                }
                estimator.touched(contact_m, reach.contact_s);
            }
        }
        sums
    };
    let [still, moved] = [0.0, 0.08].map(|moved_m| mean_m(moved_m, 23..30));
    for (moved_m, still_m) in moved.into_iter().zip(still) {
        assert!(moved_m < still_m + 0.012, "{moved:?} {still:?}");
    }
}

#[test]
fn a_bow_to_one_side_is_learnt_from_ten_touches_and_who_has_none_loses_nothing() {
    let model = model_of_bows();
    let mean_m = |size: f64, tell: bool| -> f64 {
        let mut sum = 0.0;
        for seed in 200..210 {
            let mut estimator = model.estimator();
            for (k, reach) in bowed(seed, 20, size).iter().enumerate() {
                let all = follow(&mut estimator, &reach.frames);
                if k >= 10 {
                    sum += all[all.len() / 3].point_m.distance(reach.contact_m) / 100.0;
                }
                if tell {
                    estimator.touched(reach.contact_m, reach.contact_s);
                }
            }
        }
        sum
    };
    let [bowed, straight] = [1.0, 0.0].map(|size| [false, true].map(|tell| mean_m(size, tell)));
    assert!(bowed[1] < 0.85 * bowed[0], "{bowed:?}");
    assert!(straight[1] < 1.02 * straight[0], "{straight:?}");
}
