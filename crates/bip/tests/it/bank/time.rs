//! Time to the end.

use super::{config, evenly, goal, model, motion, step};
use hwall_bip::Bank;
use hwall_testkit::Sampler;

#[test]
fn time_to_end_counts_the_rest() {
    let model = model();
    let mut bank = Bank::new(&model, &config()).unwrap();
    let mut sampler = Sampler::new(6);
    let g = goal(&mut sampler);
    let moving = motion(&mut sampler, g, &evenly(90));
    for k in 0..45 {
        step(&mut bank, moving.sample(k));
    }
    let going = bank.time_to_end().unwrap();
    assert!((going.mean - 45.0).abs() < 6.0, "{going:?}");
    assert!(going.sd > 0.5 && going.sd < 20.0, "{going:?}");
    for _ in 0..30 {
        step(&mut bank, moving.sample(45));
    }
    let resting = bank.time_to_end().unwrap();
    assert!(resting.mean > going.mean, "{resting:?}");
    assert!(resting.sd > going.sd, "{resting:?}");
}

#[test]
fn time_to_end_stays_bounded_through_a_pause() {
    let model = model();
    let mut sampler = Sampler::new(44);
    let g = goal(&mut sampler);
    let progress: Vec<f64> = (0..150)
        .map(|k| match k {
            0..36 => f64::from(k) / 90.0,
            36..96 => 0.4,
            _ => (0.4 + f64::from(k - 96) / 90.0).min(1.0),
        })
        .collect();
    let seen = motion(&mut sampler, g, &progress);
    let mut bank = Bank::new(&model, &config()).unwrap();
    for k in 0..150 {
        step(&mut bank, seen.sample(k));
        if let Some(left) = bank.time_to_end() {
            assert!(left.mean < 500.0 && left.sd < 500.0, "{k}: {left:?}");
        }
    }
}
