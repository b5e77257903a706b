//! Priors of several components, and small numbers of hypotheses.

use super::{HAND, config, demonstrations, evenly, goal, miss, model, motion, step, training};
use crate::common;
use hwall_bip::{Bank, BankConfig, BipError, Covariance, Demonstration, Mixture, Mode, Model};
use hwall_testkit::{Sampler, minimum_jerk};

#[test]
fn hypotheses_stay_few_and_their_modes_are_told() {
    let model = model();
    let few = BankConfig {
        hypotheses: 3,
        ..config()
    };
    let mut bank = Bank::new(&model, &few).unwrap();
    let mut sampler = Sampler::new(7);
    let g = goal(&mut sampler);
    let seen = motion(&mut sampler, g, &evenly(70));
    for k in 0..70 {
        step(&mut bank, seen.sample(k));
    }
    assert!(bank.hypotheses().count() <= 3);
    assert!(bank.hypotheses().any(|h| h.mode == Mode::Moving));
    assert!(miss(&mut bank, g) < 0.02);
}

/// Two people: one reaches high in a curve, the other low. The mixture must recognise the person and predict the end better than with one blurred
/// prior.
#[test]
fn a_mixture_by_person_recognises_the_person() {
    let mut sampler = Sampler::new(8);
    let person = |sampler: &mut Sampler, who: usize| {
        let bow = if who == 0 { 0.15 } else { -0.15 };
        let depth = sampler.uniform(0.5, 0.7);
        let samples = 60 + sampler.index(40);
        let mut values = Vec::new();
        for t in evenly(samples) {
            let r = minimum_jerk(t);
            values.push(depth * r + 0.3 * t + 2e-3 * sampler.normal());
            values.push(bow * (2.0 * t - r) + 2e-3 * sampler.normal());
            values.push(bow * depth * r + 2e-3 * sampler.normal());
            values.push(depth * r + 2e-3 * sampler.normal());
        }
        Demonstration::from_samples(1.0, 4, values).unwrap()
    };
    let labels: Vec<usize> = (0..16).map(|i| i % 2).collect();
    let all: Vec<_> = labels.iter().map(|w| person(&mut sampler, *w)).collect();
    let mixture = Mixture::train(&all, &training(), &labels, Covariance::Own).unwrap();
    assert_eq!(mixture.models().len(), 2);
    assert_eq!(mixture.members()[1][0], 1);
    for who in [0, 1] {
        let seen = person(&mut sampler, who);
        let mut bank = mixture.bank(&config()).unwrap();
        for k in 0..seen.len() / 2 {
            step(&mut bank, seen.sample(k));
        }
        assert!(bank.component_probability(who) > 0.99);
    }
}

#[test]
fn groups_at_their_limits() {
    let all = demonstrations(9, 6);
    let train = |labels: &[usize]| {
        let own = Mixture::train(&all, &training(), labels, Covariance::Own);
        let shared = Mixture::train(&all, &training(), labels, Covariance::Shared);
        if let Ok(own) = &own {
            assert_eq!(own.members(), shared.unwrap().members());
        }
        own
    };
    assert!(matches!(train(&[0; 5]), Err(BipError::WrongLength { .. })));
    assert!(matches!(
        train(&[0, 0, 0, 0, 0, 1]),
        Err(BipError::TooFewDemonstrations { needed: 2, got: 1 })
    ));
    assert!(Mixture::train(&[], &training(), &[], Covariance::Shared).is_err());
    let pairs = train(&[7, 7, 3, 3, 5, 5]).unwrap();
    assert_eq!(pairs.members(), [[2, 3], [4, 5], [0, 1]]);
    assert!((pairs.probabilities().iter().sum::<f64>() - 1.0).abs() < 1e-12);
    // Each demonstration is its own group: no variation remains within groups.
    let alone = Mixture::train(&all, &training(), &[0, 1, 2, 3, 4, 5], Covariance::Shared).unwrap();
    assert!(alone.models().iter().all(|m| m.rank() == 0));
    let single = Mixture::train(&all, &training(), &[4; 6], Covariance::Shared).unwrap();
    let plain = Model::train(&all, &training()).unwrap();
    let (mut a, mut b) = ([0.0; 4], [0.0; 4]);
    single.models()[0].mean_at(0.7, &mut a).unwrap();
    plain.mean_at(0.7, &mut b).unwrap();
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12));
    assert_eq!(single.models()[0].rank(), plain.rank());
}

/// Ten targets, one component each: none is dropped before it can be distinguished, and a change of target is a change of component.
#[test]
fn components_of_many_targets_are_kept_and_changed() {
    let mut sampler = Sampler::new(43);
    let targets: Vec<[f64; 3]> = (0..10).map(|_| goal(&mut sampler)).collect();
    let labels: Vec<usize> = (0..50).map(|i| i % 10).collect();
    let near = |sampler: &mut Sampler, t: usize| targets[t].map(|x| x + 0.01 * sampler.normal());
    let all: Vec<_> = labels
        .iter()
        .map(|&t| {
            let g = near(&mut sampler, t);
            let samples = 70 + sampler.index(40);
            motion(&mut sampler, g, &evenly(samples))
        })
        .collect();
    let mixture = Mixture::train(&all, &training(), &labels, Covariance::Shared).unwrap();
    for (truth, &target) in targets.iter().enumerate() {
        let seen = motion(&mut sampler, target, &evenly(90));
        let mut bank = mixture.bank(&config()).unwrap();
        for k in 0..60 {
            step(&mut bank, seen.sample(k));
        }
        assert!(bank.component_probability(truth) > 0.5, "target {truth}");
    }
    // From the first target to the second, between 0.3 and 0.45 of the time.
    let mut bank = mixture.bank(&config()).unwrap();
    for t in evenly(100) {
        let over = minimum_jerk((t - 0.3) / 0.15);
        let y = [0, 1, 2].map(|d| {
            let g = targets[0][d] + over * (targets[1][d] - targets[0][d]);
            g * minimum_jerk(t) + 0.3 * t + 1e-3 * sampler.normal()
        });
        common::step(&mut bank, &HAND, &y);
    }
    assert!(bank.component_probability(1) > 0.5);
    assert!(miss(&mut bank, targets[1]) < 0.02);
}
