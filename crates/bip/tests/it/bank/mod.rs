//! Banks of hypotheses.

mod components;
mod input;
mod joining;
mod time;
mod turns;

use crate::common;
use hwall_bip::{
    Bank, BankConfig, Basis, Demonstration, FilterConfig, Group, Model, TrainingConfig,
};
use hwall_testkit::{Sampler, minimum_jerk};

const HAND: [usize; 3] = [0, 1, 2];

/// A hand reaches from the origin to a goal, a fourth value responds; `progress` is the completed share of the motion at each sample.
fn motion(sampler: &mut Sampler, goal: [f64; 3], progress: &[f64]) -> Demonstration {
    let mut values = Vec::new();
    for &t in progress {
        let r = minimum_jerk(t);
        for x in goal {
            values.push(x * r + 0.3 * t + 1e-3 * sampler.normal());
        }
        values.push(goal.iter().sum::<f64>() * r + 1e-3 * sampler.normal());
    }
    Demonstration::from_samples(1.0, 4, values).unwrap()
}

fn evenly(samples: usize) -> Vec<f64> {
    (0..samples)
        .map(|k| k as f64 / (samples - 1) as f64)
        .collect()
}

fn goal(sampler: &mut Sampler) -> [f64; 3] {
    [
        sampler.uniform(0.4, 0.8),
        sampler.uniform(-0.3, 0.3),
        sampler.uniform(-0.3, 0.3),
    ]
}

fn training() -> TrainingConfig {
    let basis = Basis::Legendre { count: 8 };
    TrainingConfig::new(vec![
        Group::observed("hand", 3, basis),
        Group::controlled("arm", 1, basis),
    ])
}

fn demonstrations(seed: u64, count: usize) -> Vec<Demonstration> {
    let mut sampler = Sampler::new(seed);
    (0..count)
        .map(|_| {
            let g = goal(&mut sampler);
            let samples = 60 + sampler.index(60);
            motion(&mut sampler, g, &evenly(samples))
        })
        .collect()
}

fn model() -> Model {
    Model::train(&demonstrations(1, 20), &training()).unwrap()
}

/// Independent noise, as here, needs no factor; data from a real person do.
fn config() -> BankConfig {
    BankConfig {
        filter: FilterConfig {
            noise_factor: Some(16.0),
            ..FilterConfig::default()
        },
        ..BankConfig::default()
    }
}

/// Distance of the predicted end of the hand from a goal.
fn miss(bank: &mut Bank, goal: [f64; 3]) -> f64 {
    let [mean, _] = common::moments(bank, 1.0, HAND);
    mean.iter()
        .zip(goal)
        .map(|(m, g)| (m - g - 0.3).powi(2))
        .sum::<f64>()
        .sqrt()
}

fn step(bank: &mut Bank, sample: &[f64]) {
    common::step(bank, &HAND, &sample[..3]);
    let sum: f64 = bank.hypotheses().map(|h| h.probability).sum();
    assert!((sum - 1.0).abs() < 1e-12);
}
