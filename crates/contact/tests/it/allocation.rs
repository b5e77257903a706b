//! A step of the learned estimator does not allocate.

use crate::reaches::reaches;
use hwall_contact::{Combination, ContactEstimator, LearnedConfig, LearnedModel};
use hwall_hand::{HandFrame, HandPoint};

/// Number of samples after which nothing may be allocated: beginning a reach copies the primitive, whose copy grows one list at the first
/// observation.
const FIRST: usize = 3;

fn steps_allocate(combination: Combination, frames: &[HandFrame]) -> u64 {
    let config = LearnedConfig {
        combination,
        ..LearnedConfig::default()
    };
    let model = LearnedModel::train(&reaches(1, 3, 12), &config).expect("good reaches");
    let mut estimator = model.estimator();
    let mut count = 0;
    // A second reach must not allocate either.
    for _ in 0..2 {
        estimator.begin();
        for frame in &frames[..FIRST] {
            estimator.step(frame);
        }
        let info = allocation_counter::measure(|| {
            for frame in &frames[FIRST..] {
                assert!(estimator.step(frame).is_some());
            }
        });
        count += info.count_total;
    }
    count
}

#[test]
fn steps_do_not_allocate() {
    let frames = &reaches(2, 1, 1)[0].frames;
    for combination in [
        Combination::Regression,
        Combination::Primitive,
        Combination::Both,
    ] {
        assert_eq!(steps_allocate(combination, frames), 0, "{combination:?}");
    }
}

#[test]
fn steps_do_not_allocate_when_points_are_missing_or_the_reach_does_not_end() {
    let mut frames = reaches(2, 1, 1)[0].frames.clone();
    for (k, frame) in frames.iter_mut().enumerate() {
        if k % 3 == 1 {
            frame.set_point(HandPoint::Index, None);
        }
        if k % 5 == 2 {
            frame.set_point(HandPoint::Palm, None);
        }
    }
    // A hand that waits in front of the wall: more samples than the track keeps.
    let last = frames[frames.len() - 1];
    frames.extend((1..=1500).map(|k| HandFrame {
        t_s: last.t_s + f64::from(k) / 90.0,
        ..last
    }));
    assert_eq!(steps_allocate(Combination::Both, &frames), 0);
}
