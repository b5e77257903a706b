//! Recordings as they come: whatever can be read is learnt from, and no estimate is NaN.

use glam::DVec3;
use hwall_contact::score::{Evaluation, Moment, Split};
use hwall_contact::{ContactEstimator, LearnedConfig, LearnedModel};
use hwall_hand::{HandFrame, HandPoint, LabelledReach};
use hwall_testkit::Sampler;

/// Reaches of half a metre by several people; the palm and the head are tracked as well.
fn reaches(seed: u64, people: usize, each: usize) -> Vec<LabelledReach> {
    let mut sampler = Sampler::new(seed);
    let mut all = Vec::new();
    for person in 0..people {
        for trial in 0..each {
            let from = DVec3::new(0.6, 0.1, 0.1) + 0.03 * noise(&mut sampler);
            let to = DVec3::new(0.0, sampler.uniform(-0.3, 0.3), sampler.uniform(0.0, 0.5));
            let duration_s = sampler.uniform(0.6, 0.9);
            let frames = (0..=60)
                .map(|k| {
                    let tau = f64::from(k) / 60.0;
                    let share = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
                    let tip = from.lerp(to, share) + 7e-4 * noise(&mut sampler);
                    let mut frame = HandFrame::empty(tau * duration_s);
                    frame.set_point(HandPoint::Index, Some(tip));
                    frame.set_point(HandPoint::Palm, Some(tip + DVec3::X * 0.1));
                    frame.head_m = Some(DVec3::new(0.8, 0.0, 0.6) - DVec3::X * 0.05 * share);
                    frame
                })
                .collect();
            let reach = LabelledReach::new(HandPoint::Index, frames, to, duration_s);
            all.push(reach.by(format!("person {person}"), trial.to_string()));
        }
    }
    all
}

fn noise(sampler: &mut Sampler) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| sampler.normal()))
}

/// Learns from some reaches and follows others, told of each touch; every number must be finite.
fn follow(known: &[LabelledReach], others: &[LabelledReach]) -> usize {
    let model = LearnedModel::train(known, &LearnedConfig::default()).expect("learnt from");
    let mut estimator = model.estimator();
    let mut count = 0;
    for reach in others {
        estimator.begin();
        for frame in &reach.frames {
            if let Some(estimate) = estimator.step(frame) {
                let covariance = estimate.covariance_m2.expect("stated");
                assert!(estimate.point_m.is_finite() && covariance.is_finite());
                assert!(covariance.determinant() > 0.0, "{covariance}");
                let time = estimate.time_to_contact_s.expect("stated");
                assert!(time.mean_s.is_finite() && time.sd_s.expect("stated") > 0.0);
                count += 1;
            }
        }
        estimator.touched(reach.contact_m, reach.contact_s);
        assert!(estimator.surprise().is_finite());
    }
    assert!(!model.account().to_string().contains("NaN"));
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
    // A head that was always there, and then never again.
    let mut blind = reaches(4, 1, 2);
    blind
        .iter_mut()
        .flat_map(|r| &mut r.frames)
        .for_each(|f| f.head_m = None);
    assert_eq!(follow(&reaches(1, 3, 8), &blind), 122);
}

#[test]
fn people_of_one_touch_and_sessions_of_one_reach() {
    let known = reaches(5, 12, 1);
    assert_eq!(follow(&known, &reaches(6, 3, 1)), 183);
    // One person with nearly everything, others with a single touch.
    let mut uneven = reaches(7, 1, 12);
    uneven.extend(
        reaches(8, 3, 1)
            .into_iter()
            .enumerate()
            .map(|(k, r)| r.by(format!("late {k}"), "0")),
    );
    assert_eq!(follow(&uneven, &reaches(9, 1, 1)), 61);
}

#[test]
fn coordinates_that_never_change() {
    // Everybody touches one point; then a hand that does not move at all.
    let mut one_place = reaches(10, 3, 4);
    for reach in &mut one_place {
        let shift_m = DVec3::ZERO - reach.contact_m;
        for frame in &mut reach.frames {
            let moved = |f: &HandFrame, p| f.point(p).map(|at_m| at_m + shift_m);
            let (tip, palm) = (
                moved(frame, HandPoint::Index),
                moved(frame, HandPoint::Palm),
            );
            frame.set_point(HandPoint::Index, tip);
            frame.set_point(HandPoint::Palm, palm);
        }
        reach.contact_m = DVec3::ZERO;
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
        // A pause of minutes in the middle, and clocks that begin anywhere.
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
            let estimate = estimator.step(frame).expect("tracked");
            assert!(
                estimate.point_m.is_finite() && estimate.covariance_m2.expect("stated").is_finite()
            );
        }
        let wrong_m = [DVec3::NAN, DVec3::splat(1e5), DVec3::INFINITY][k % 3];
        estimator.touched(wrong_m, reach.contact_s);
    }
    assert_eq!(estimator.touches(), 2);
    // Forgotten is forgotten.
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
        for frame in &mut reach.frames {
            let at = |f: &HandFrame, p| f.point(p).map(|at_m| at_m + moved_m);
            let (tip, palm) = (at(frame, HandPoint::Index), at(frame, HandPoint::Palm));
            frame.set_point(HandPoint::Index, tip);
            frame.set_point(HandPoint::Palm, palm);
            frame.head_m = frame.head_m.map(|at_m| at_m + moved_m);
        }
        reach.contact_m += moved_m;
    }
    let all: Vec<LabelledReach> = known.into_iter().chain(moved).collect();
    let split = Split {
        description: String::new(),
        folds: vec![hwall_contact::score::Fold {
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
    // At 90 % of the time both are within the noise of the tracker.
    for (share, better) in [(0.5, 0.8), (0.7, 0.4), (0.9, 2.0)] {
        let late = |e: &Evaluation| e.among(|r| r.reach >= 84, |m| m == Moment::Share(share));
        let (silent, told) = (late(&silent), late(&told));
        println!(
            "{share}: {:.4} {:.4} m, {:?}",
            silent.median_m,
            told.median_m,
            told.covered()
        );
        assert!(told.median_m < better * silent.median_m, "{share}");
    }
}
