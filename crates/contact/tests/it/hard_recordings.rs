//! Difficult recordings: anything readable can be used for training, and no estimate is NaN.

use crate::common::check_all;
use crate::learned::reaches_of;
use glam::DVec3;
use hwall_contact::score::{Evaluation, Fold, Moment, Split};
use hwall_contact::{ContactEstimator, LearnedConfig, LearnedModel};
use hwall_hand::{HandFrame, HandPoint, LabelledReach};
use hwall_testkit::{Sampler, minimum_jerk};

/// Palm and head are also tracked.
fn reaches(seed: u64, people: usize, each: usize) -> Vec<LabelledReach> {
    reaches_of(seed, (people, each), |sampler, tau, [_, _, tip_m]| {
        let tip_m = tip_m + 7e-4 * sampler.normal_vector();
        let head_m = DVec3::new(0.8, 0.0, 0.6) - DVec3::X * 0.05 * minimum_jerk(tau);
        let mut frame = HandFrame::empty(0.0);
        frame.set_point(HandPoint::Index, Some(tip_m));
        frame.set_point(HandPoint::Palm, Some(tip_m + DVec3::X * 0.1));
        frame.head_m = Some(head_m);
        frame
    })
}

/// Offset from the training place.
fn shifted(reach: &mut LabelledReach, by_m: DVec3) {
    for frame in &mut reach.frames {
        for point in [HandPoint::Index, HandPoint::Palm] {
            let at_m = frame.point(point).map(|at_m| at_m + by_m);
            frame.set_point(point, at_m);
        }
    }
    reach.contact_m += by_m;
}

fn samples(all: &[LabelledReach]) -> usize {
    all.iter().map(|reach| reach.frames.len()).sum()
}

/// Trains on some reaches and follows others, with touch feedback; every number must be finite.
fn follow(known: &[LabelledReach], others: &[LabelledReach]) -> usize {
    let model = LearnedModel::train(known, &LearnedConfig::default()).expect("learnt from");
    let mut estimator = model.estimator();
    let mut count = 0;
    for reach in others {
        estimator.begin();
        for frame in &reach.frames {
            if let Some(estimate) = estimator.step(frame) {
                check_all(&estimate);
                count += 1;
            }
        }
        estimator.touched(reach.contact_m, reach.contact_s);
        assert!(estimator.surprise().is_finite());
    }
    count
}

#[test]
fn points_that_come_and_go() {
    let mut sampler = Sampler::new(2);
    let holes = |mut all: Vec<LabelledReach>, sampler: &mut Sampler| {
        for frame in all.iter_mut().flat_map(|r| &mut r.frames) {
            for point in [HandPoint::Index, HandPoint::Palm] {
                if sampler.uniform(0.0, 1.0) < 0.3 {
                    frame.set_point(point, None);
                }
            }
            match sampler.uniform(0.0, 1.0) {
                0.0..0.3 => frame.head_m = None,
                0.3..0.35 => frame.head_m = Some(DVec3::NAN),
                _ => {}
            }
        }
        all
    };
    let known = holes(reaches(1, 4, 8), &mut sampler);
    let others = holes(reaches(3, 2, 4), &mut sampler);
    assert!(follow(&known, &others) > 300);
    // A head that was always tracked, and then never again.
    let mut blind = reaches(4, 1, 2);
    let frames = blind.iter_mut().flat_map(|r| &mut r.frames);
    frames.for_each(|f| f.head_m = None);
    assert_eq!(follow(&reaches(1, 3, 8), &blind), samples(&blind));
}

#[test]
fn people_of_one_touch_and_sessions_of_one_reach() {
    let known = reaches(5, 12, 1);
    let test = reaches(6, 3, 1);
    assert_eq!(follow(&known, &test), samples(&test));
    // One person with nearly all reaches, others with a single touch.
    let mut uneven = reaches(7, 1, 12);
    let late = reaches(8, 3, 1).into_iter().enumerate();
    uneven.extend(late.map(|(k, r)| r.by(format!("late {k}"), "0")));
    assert_eq!(follow(&uneven, &test), samples(&test));
}

#[test]
fn coordinates_that_never_change() {
    // Everybody touches one point; then a hand that does not move at all.
    let mut one_place = reaches(10, 3, 4);
    for reach in &mut one_place {
        shifted(reach, -reach.contact_m);
    }
    assert!(follow(&one_place, &one_place) > 0);
    let mut still = reaches(11, 3, 4);
    for reach in &mut still {
        for frame in &mut reach.frames {
            frame.set_point(HandPoint::Index, Some(DVec3::ONE));
            frame.set_point(HandPoint::Palm, Some(DVec3::ONE));
            frame.head_m = Some(DVec3::ONE);
        }
        reach.contact_m = DVec3::ONE;
    }
    assert!(follow(&still, &still) > 0);
    assert!(follow(&still, &reaches(12, 1, 2)) > 0);
}

#[test]
fn clocks_that_jump() {
    let mut jumping = reaches(13, 3, 5);
    for (k, reach) in jumping.iter_mut().enumerate() {
        // A pause of minutes in the middle, and arbitrary clock offsets.
        let start_s = [0.0, 1.7e9, -40.0][k % 3];
        let pause_s = [0.0, 200.0, 1e-9][k % 3];
        for (i, frame) in reach.frames.iter_mut().enumerate() {
            frame.t_s += start_s + if i > 30 { pause_s } else { 0.0 };
        }
        reach.contact_s += start_s + pause_s;
    }
    assert!(follow(&jumping, &jumping) > 800);
    assert!(follow(&reaches(14, 3, 5), &jumping) > 800);
}

#[test]
fn touches_far_away_or_not_a_number_are_survived() {
    let model = LearnedModel::train(&reaches(15, 3, 8), &LearnedConfig::default()).expect("good");
    let mut estimator = model.estimator();
    let test = reaches(16, 1, 6);
    for (k, reach) in test.iter().enumerate() {
        estimator.begin();
        for frame in &reach.frames {
            check_all(&estimator.step(frame).expect("tracked"));
        }
        let wrong_m = [DVec3::NAN, DVec3::splat(1e5), DVec3::INFINITY][k % 3];
        estimator.touched(wrong_m, reach.contact_s);
    }
    assert_eq!(estimator.touches(), 2);
    // After `forget`, nothing is left.
    estimator.forget();
    let fresh = &mut model.estimator();
    estimator.begin();
    fresh.begin();
    for frame in &test[0].frames {
        assert_eq!(estimator.step(frame), fresh.step(frame));
    }
}

#[test]
fn a_room_that_moves_is_noticed_and_followed_within_a_few_touches() {
    let known = reaches(17, 5, 16);
    let moved_m = DVec3::new(0.12, -0.05, 0.0);
    let mut moved = reaches(18, 1, 12);
    for reach in &mut moved {
        shifted(reach, moved_m);
        let heads = reach.frames.iter_mut().filter_map(|f| f.head_m.as_mut());
        heads.for_each(|head_m| *head_m += moved_m);
    }
    let all: Vec<LabelledReach> = known.into_iter().chain(moved).collect();
    let split = Split {
        description: String::new(),
        folds: vec![Fold {
            train: (0..80).collect(),
            test: (80..92).collect(),
        }],
    };
    let config = LearnedConfig::default();
    let run = |tell| {
        let train = |r: &[&LabelledReach]| Ok(LearnedModel::train(r, &config)?.estimator());
        Evaluation::run(&all, &split, tell, train).expect("good")
    };
    let (silent, told) = (run(false), run(true));
    // At 90 % of the time both errors are within tracker noise.
    for (share, better) in [(0.5, 0.8), (0.7, 0.4), (0.9, 2.0)] {
        let late = |e: &Evaluation| e.among(|r| r.reach >= 84, |m| m == Moment::Share(share));
        let (silent, told) = (late(&silent), late(&told));
        assert!(told.median_m < better * silent.median_m, "{share}");
    }
}
