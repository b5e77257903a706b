//! Pauses, changes of mind, late starts: behaviour that no demonstration contains.

use super::{HAND, config, evenly, goal, miss, model, motion, step};
use crate::common;
use hwall_bip::{Bank, BankConfig, Filter};
use hwall_testkit::{Sampler, minimum_jerk};

#[test]
fn without_turns_a_bank_is_its_filter() {
    let model = model();
    let mut sampler = Sampler::new(2);
    let still = BankConfig {
        split_velocity: false,
        pauses: 0.0,
        changes: 0.0,
        not_begun: 0.0,
        under_way: 0.0,
        ..config()
    };
    let mut bank = Bank::new(&model, &still).unwrap();
    let mut filter = Filter::new(&model, &still.filter).unwrap();
    let g = goal(&mut sampler);
    let seen = motion(&mut sampler, g, &evenly(80));
    for k in 0..80 {
        step(&mut bank, seen.sample(k));
        common::step(&mut filter, &HAND, &seen.sample(k)[..3]);
        assert!((bank.phase() - filter.phase()).abs() < 1e-12);
    }
    let [a, va] = common::moments(&mut bank, 1.0, [0, 1, 2, 3]);
    let [b, vb] = common::moments(&mut filter, 1.0, [0, 1, 2, 3]);
    for d in 0..4 {
        assert!((a[d] - b[d]).abs() < 1e-12);
        assert!((va[d] / vb[d] - 1.0).abs() < 1e-9);
    }
    let difference = bank.health().log_likelihood - filter.health().log_likelihood;
    assert!(difference.abs() < 1e-8);
}

#[test]
fn a_pause_is_recognised_and_overcome() {
    let model = model();
    let mut sampler = Sampler::new(3);
    let mut worst_filter: f64 = 0.0;
    for _ in 0..5 {
        let g = goal(&mut sampler);
        // The hand rests for 40 samples after 0.4 of the way.
        let progress: Vec<f64> = (0..130)
            .map(|k| match k {
                0..36 => f64::from(k) / 90.0,
                36..76 => 0.4,
                _ => 0.4 + f64::from(k - 76) / 90.0,
            })
            .collect();
        let seen = motion(&mut sampler, g, &progress);
        let mut bank = Bank::new(&model, &config()).unwrap();
        let mut filter = Filter::new(&model, &config().filter).unwrap();
        let mut resting: f64 = 0.0;
        for k in 0..130 {
            step(&mut bank, seen.sample(k));
            common::step(&mut filter, &HAND, &seen.sample(k)[..3]);
            if (50..76).contains(&k) {
                resting = resting.max(bank.resting());
            }
        }
        assert!(resting > 0.9, "rest not seen: {resting}");
        assert!(bank.resting() < 0.5 || bank.phase() > 0.95);
        let missed = miss(&mut bank, g);
        assert!(missed < 0.02, "{missed} m off at the end");
        let [mean, _] = common::moments(&mut filter, 1.0, HAND);
        for (m, g) in mean.iter().zip(g) {
            worst_filter = worst_filter.max((m - g - 0.3).abs());
        }
    }
    // The single filter does not recover.
    assert!(worst_filter > 0.02, "{worst_filter}");
}

#[test]
fn a_change_of_mind_is_followed() {
    let model = model();
    let mut sampler = Sampler::new(4);
    let mut missed = Vec::new();
    for _ in 0..8 {
        let (first, second) = (goal(&mut sampler), goal(&mut sampler));
        // The hand turns to the second goal between 0.35 and 0.55 of the time.
        let mut values = Vec::new();
        for t in evenly(100) {
            let over = minimum_jerk((t - 0.35) / 0.2);
            for d in 0..3 {
                let g = first[d] + over * (second[d] - first[d]);
                values.push(g * minimum_jerk(t) + 0.3 * t + 1e-3 * sampler.normal());
            }
        }
        let mut bank = Bank::new(&model, &config()).unwrap();
        for k in 0..100 {
            common::step(&mut bank, &HAND, &values[3 * k..3 * k + 3]);
            if k == 77 {
                missed.push(miss(&mut bank, second));
            }
        }
        assert!(miss(&mut bank, second) < 0.02);
    }
    missed.sort_by(f64::total_cmp);
    assert!(missed[4] < 0.06, "half way after the change: {missed:?}");
}

#[test]
fn a_hand_that_dwells_before_it_starts() {
    let model = model();
    let mut sampler = Sampler::new(5);
    let g = goal(&mut sampler);
    let progress: Vec<f64> = (0..150)
        .map(|k| (f64::from(k) - 60.0).max(0.0) / 89.0)
        .collect();
    let seen = motion(&mut sampler, g, &progress);
    let mut bank = Bank::new(&model, &config()).unwrap();
    for k in 0..150 {
        step(&mut bank, seen.sample(k));
        if k == 58 {
            assert!(bank.resting() > 0.9);
            assert!(bank.phase() < 0.05);
            assert_eq!(bank.phase_velocity() < 0.002, bank.resting() > 0.9);
        }
        if k == 60 + 71 {
            assert!((bank.phase() - 0.8).abs() < 0.05, "{}", bank.phase());
        }
    }
    assert!(miss(&mut bank, g) < 0.02);
}

/// Regression test: a stop that takes a tenth of the motion, or falls between two branchings on a coarser grid, was mistaken for another
/// shape. A filter that joined late mistook a fifth of the motion for another shape.
#[test]
fn intervals_hold_after_sudden_and_gradual_stops_and_a_late_start() {
    let model = model();
    let sudden = |k: u32| match k {
        0..37 => f64::from(k) / 90.0,
        37..77 => 37.0 / 90.0,
        _ => f64::from(k - 40) / 90.0,
    };
    // Ten samples slowing down, forty at rest, ten speeding up: each ramp covers as much as five samples at full speed.
    let gradual = |k: u32| match k {
        0..32 => f64::from(k) / 90.0,
        32..42 => (32.0 + f64::from(k - 32) - f64::from(k - 32).powi(2) / 20.0) / 90.0,
        42..82 => 37.0 / 90.0,
        82..92 => (37.0 + f64::from(k - 82).powi(2) / 20.0) / 90.0,
        _ => (42.0 + f64::from(k - 92)) / 90.0,
    };
    let late = |k: u32| (0.45 + f64::from(k) / 90.0).min(1.0);
    type Progress<'a> = &'a dyn Fn(u32) -> f64;
    let cases: [(&str, Progress<'_>, [u32; 2]); 3] = [
        ("sudden", &sudden, [40, 105]),
        ("gradual", &gradual, [45, 120]),
        ("late", &late, [10, 45]),
    ];
    for (name, progress, [from, to]) in cases {
        let mut sampler = Sampler::new(45);
        let (mut within, mut all, mut timed) = (0, 0, 0);
        for _ in 0..20 {
            let g = goal(&mut sampler);
            let places: Vec<f64> = (0..to).map(progress).collect();
            let seen = motion(&mut sampler, g, &places);
            let mut bank = Bank::new(&model, &config()).unwrap();
            for k in 0..to {
                step(&mut bank, seen.sample(k as usize));
                if k < from {
                    continue;
                }
                let (mut mean, mut variance) = ([0.0; 3], [0.0; 3]);
                bank.predict_at(1.0, &HAND, &mut mean, &mut variance)
                    .unwrap();
                for d in 0..3 {
                    let away = (mean[d] - g[d] - 0.3).abs();
                    within += u32::from(away <= 3.0 * variance[d].sqrt() + 0.002);
                    all += 1;
                }
                timed += u32::from(bank.time_to_end().is_some());
            }
        }
        assert!(within * 100 >= 95 * all, "{name}: {within} of {all}");
        assert!(timed * 10 >= 3 * all, "{name}: {timed} times of {all}");
    }
}
