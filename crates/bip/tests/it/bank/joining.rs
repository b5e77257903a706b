//! A filter that joins a motion late, or a hand away from the start.

use super::{HAND, config, evenly, goal, miss, model, motion, step};
use crate::common;
use hwall_bip::{Bank, BankConfig};
use hwall_testkit::Sampler;

/// The filter starts well into the motion: the beginning is never observed.
#[test]
fn a_motion_that_is_under_way_is_joined() {
    let model = model();
    // The noise of the fit alone is fifteen times smaller than the linearisation error of the phase. With it, the first samples exclude a phase
    // that is off by a few percent, and with it the hypotheses next to the true one. Early in the motion none is lost; where the hand is fastest
    // some are: over four seeds 0, 0, 11, 34 and 16 of 320, joined at 10 to 50 %. More joining phases or a wider initial variance would hide that
    // the noise is too small. With a larger noise, no late start is lost.
    let none = [0; 5];
    let cases = [
        ("wide", config(), none, 0.0),
        ("wide after a wait", config(), none, 0.2),
        ("fit", BankConfig::default(), [0, 0, 4, 6, 6], 0.0),
    ];
    for (name, config, lost, wait) in cases {
        let mut sampler = Sampler::new(410);
        for (late, lost) in [10, 20, 30, 40, 50].into_iter().zip(lost) {
            let (mut missed, mut within) = (0, 0);
            for _ in 0..80 {
                let g = goal(&mut sampler);
                let seen = motion(&mut sampler, g, &evenly(100));
                let mut bank = Bank::new(&model, &config).unwrap();
                bank.predict(wait).unwrap();
                for k in late..100 {
                    step(&mut bank, seen.sample(k));
                    if k == 70 {
                        let (mut mean, mut variance) = ([0.0; 3], [0.0; 3]);
                        bank.predict_at(1.0, &HAND, &mut mean, &mut variance)
                            .unwrap();
                        let held = |d: &usize| {
                            (mean[*d] - g[*d] - 0.3).abs() <= 1.645 * variance[*d].sqrt()
                        };
                        within += (0..3).filter(held).count();
                    }
                }
                missed += usize::from(miss(&mut bank, g) >= 0.03);
            }
            assert!(missed <= lost, "{name}, joined at {late} %: {missed} lost");
            let held = within as f64 / 240.0;
            assert!(name == "fit" || held >= 0.9, "joined at {late} %: {held}");
        }
    }
}

/// Regression test: step by step, branches of other hypotheses filled the places for motions under way.
#[test]
fn an_ordinary_motion_has_few_hypotheses_from_its_third_sample_on() {
    let model = model();
    let mut sampler = Sampler::new(46);
    for _ in 0..10 {
        let g = goal(&mut sampler);
        let seen = motion(&mut sampler, g, &evenly(100));
        let mut bank = Bank::new(&model, &BankConfig::default()).unwrap();
        for k in 0..20 {
            step(&mut bank, seen.sample(k));
            let (count, on_the_way) = (
                bank.hypotheses().count(),
                bank.hypotheses().filter(|h| h.phase > 0.3).count(),
            );
            assert!(k < 2 || count - on_the_way <= 16, "{k}: {count}");
            assert!(k < 10 || count <= 8, "{k}: {count}");
        }
    }
}

/// A hand that appears away from the start and stays there: the bank does not diverge, and detects a motion after it.
#[test]
fn a_hand_frozen_away_from_the_start() {
    let model = model();
    let mut sampler = Sampler::new(42);
    let g = goal(&mut sampler);
    let seen = motion(&mut sampler, g, &evenly(100));
    let mut bank = Bank::new(&model, &BankConfig::default()).unwrap();
    for _ in 0..2_000 {
        step(&mut bank, seen.sample(30));
    }
    let [mean, _] = common::moments(&mut bank, 1.0, HAND);
    assert!(mean.iter().all(|m| m.abs() < 2.0), "{mean:?}");
    for k in 30..100 {
        step(&mut bank, seen.sample(k));
    }
    assert!(miss(&mut bank, g) < 0.05, "{}", miss(&mut bank, g));
}
