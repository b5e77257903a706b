//! Adaptation of the learned estimator to a person's touches.

use crate::learned::{follow, reaches};
use glam::DVec3;
use hwall_contact::{ContactEstimator, LearnedConfig, LearnedModel};
use hwall_hand::{HandPoint, LabelledReach};
use hwall_testkit::Sampler;
use std::ops::Range;
use std::sync::OnceLock;

/// Mean errors of point, m, and arrival, s, in the counted reaches of each person, at samples of a reach of this many; `tells`: each touch is
/// reported.
fn mean_errors<const N: usize>(
    model: &LearnedModel,
    people: &[Vec<LabelledReach>],
    counted: Range<usize>,
    tells: bool,
    at: [fn(usize) -> usize; N],
) -> [[f64; 2]; N] {
    let count = (people.len() * counted.len()) as f64;
    let mut means = [[0.0; 2]; N];
    for reaches in people {
        let mut estimator = model.estimator();
        for (k, reach) in reaches.iter().enumerate() {
            let all = follow(&mut estimator, &reach.frames);
            for (mean, at) in means.iter_mut().zip(at) {
                let said = all[at(all.len())];
                let left_s = said.time_to_contact_s.expect("learnt").mean_s;
                if counted.contains(&k) {
                    mean[0] += said.point_m.distance(reach.contact_m) / count;
                    mean[1] += (said.t_s + left_s - reach.contact_s).abs() / count;
                }
            }
            if tells {
                estimator.touched(reach.contact_m, reach.contact_s);
            }
        }
    }
    means
}

/// Some people are fast first and others at the end, consistently: the same hand has more distance and time left in one case than in the other.
#[test]
fn what_is_a_persons_own_is_learnt_from_touches() {
    let of_person = |seed: u64, each: usize| {
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
    let others: Vec<_> = (200..216).map(|seed| of_person(seed, 20)).collect();
    let mean = |tells| mean_errors(&model, &others, 10..20, tells, [|count| count / 2]);
    let [[[point_m, time_s]], [[told_m, told_s]]] = [false, true].map(mean);
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
    let person = |seed: u64, moved_m: f64| {
        let mut made = bowed(seed, 30, 1.0);
        let by_m = Sampler::new(seed).normal_vector().normalize() * moved_m;
        for reach in &mut made[20..] {
            reach.contact_m += by_m;
        }
        made
    };
    let [still, moved] = [0.0, 0.08].map(|moved_m| {
        let people: Vec<_> = (200..210).map(|seed| person(seed, moved_m)).collect();
        let at: [fn(usize) -> usize; 3] = [
            |count| (0.35 * (count - 1) as f64) as usize,
            |count| (0.5 * (count - 1) as f64) as usize,
            |count| (0.8 * (count - 1) as f64) as usize,
        ];
        mean_errors(model_of_bows(), &people, 23..30, true, at)
    });
    for ([moved_m, _], [still_m, _]) in moved.into_iter().zip(still) {
        assert!(moved_m < still_m + 0.012, "{moved:?} {still:?}");
    }
}

#[test]
fn a_bow_to_one_side_is_learnt_from_ten_touches_and_who_has_none_loses_nothing() {
    let [bowed, straight] = [1.0, 0.0].map(|size| {
        let people: Vec<_> = (200..210).map(|seed| bowed(seed, 20, size)).collect();
        let mean = |tells| {
            let model = model_of_bows();
            mean_errors(model, &people, 10..20, tells, [|count| count / 3])
        };
        [false, true].map(|tells| mean(tells)[0][0])
    });
    assert!(bowed[1] < 0.85 * bowed[0], "{bowed:?}");
    assert!(straight[1] < 1.02 * straight[0], "{straight:?}");
}
