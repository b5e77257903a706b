//! The prior between what demonstrations show and what they cannot.

use crate::common;
use hwall_bip::{
    Basis, Demonstration, Filter, FilterConfig, Group, Model, Observation, Shrinkage,
    TrainingConfig,
};
use hwall_testkit::Sampler;

const DOFS: usize = 6;
const COUNT: usize = 5;

/// Every degree of freedom a random quartic of its own, or all of them multiples of one.
fn motions(seed: u64, count: usize, independent: bool) -> Vec<Demonstration> {
    let mut sampler = Sampler::new(seed);
    (0..count)
        .map(|_| {
            let common = [0; 5].map(|_| sampler.normal());
            let shapes: Vec<[f64; 5]> = (0..DOFS)
                .map(|d| match independent {
                    true => [0; 5].map(|_| sampler.normal()),
                    false => common.map(|x| (1.0 + 0.3 * d as f64) * x),
                })
                .collect();
            let samples = 30 + sampler.index(20);
            let mut values = Vec::new();
            for k in 0..samples {
                let t = k as f64 / (samples - 1) as f64;
                for shape in &shapes {
                    let smooth = shape.iter().rev().fold(0.0, |sum, c| sum * t + c);
                    values.push(smooth + 0.01 * sampler.normal());
                }
            }
            Demonstration::from_samples(1.0, DOFS, values).unwrap()
        })
        .collect()
}

fn config(shrinkage: Shrinkage) -> TrainingConfig {
    let basis = Basis::Legendre { count: COUNT };
    TrainingConfig {
        shrinkage,
        ..TrainingConfig::new(vec![Group::observed("hand", DOFS, basis)])
    }
}

fn train(demonstrations: &[Demonstration], shrinkage: Shrinkage) -> Model {
    Model::train(demonstrations, &config(shrinkage)).unwrap()
}

/// Covariance of the weights of the named basis.
fn covariance(model: &Model) -> Vec<Vec<f64>> {
    let prior = model.to_prior();
    let rows: Vec<&[f64]> = prior.factor.chunks_exact(prior.rank).collect();
    let entry = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum();
    rows.iter()
        .map(|a| rows.iter().map(|b| entry(a, b)).collect())
        .collect()
}

/// Logarithm of the density of all samples of new motions, given their phases.
fn held_out_density(model: &Model, motions: &[Demonstration]) -> f64 {
    let dofs: Vec<usize> = (0..DOFS).collect();
    let start = Filter::new(model, &FilterConfig::default()).unwrap();
    motions
        .iter()
        .map(|motion| {
            let mut filter = start.clone();
            (0..motion.len())
                .map(|k| {
                    let seen = Observation::new(&dofs, motion.sample(k));
                    let update = filter.observe_at(motion.phase(k), &seen).unwrap();
                    update.log_likelihood
                })
                .sum::<f64>()
        })
        .sum()
}

#[test]
fn none_is_the_covariance_of_the_demonstrations() {
    let demonstrations = motions(1, 9, true);
    let plain = Model::train(
        &demonstrations,
        &TrainingConfig::new(config(Shrinkage::None).groups),
    )
    .unwrap();
    assert_eq!(plain.shrinkage(), 0.0);
    assert_eq!(plain.rank(), 8);
    assert_eq!(plain, train(&demonstrations, Shrinkage::None));
    assert_eq!(plain, train(&demonstrations, Shrinkage::Fixed(0.0)));
}

#[test]
fn covariance_is_the_one_defined() {
    for count in [4, 9, 60] {
        let demonstrations = motions(2, count, true);
        let s = covariance(&train(&demonstrations, Shrinkage::None));
        let largest = s.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        for alpha in [1e-6, 0.3, 1.0] {
            let model = train(&demonstrations, Shrinkage::Fixed(alpha));
            assert_eq!(model.shrinkage(), alpha);
            assert_eq!(model.rank(), DOFS * COUNT.min(count - 1));
            let got = covariance(&model);
            for (i, row) in s.iter().enumerate() {
                for (j, s) in row.iter().enumerate() {
                    let within = i / COUNT == j / COUNT;
                    let want = if within { *s } else { (1.0 - alpha) * s };
                    assert!(
                        (got[i][j] - want).abs() < 1e-12 * largest,
                        "({i}, {j}), {alpha}"
                    );
                }
            }
        }
    }
}

#[test]
fn filter_of_single_degrees_of_freedom() {
    // With α = 1 they know nothing of each other: what is seen of one leaves the rest alone.
    let demonstrations = motions(3, 9, false);
    let model = train(&demonstrations, Shrinkage::Fixed(1.0));
    let mut filter = Filter::new(&model, &FilterConfig::default()).unwrap();
    let moments = |filter: &mut Filter| {
        let (mut mean, mut variance) = ([0.0; 2], [0.0; 2]);
        filter
            .moments_at(1.0, &[0, 3], &mut mean, &mut variance)
            .unwrap();
        (mean, variance)
    };
    let before = moments(&mut filter);
    let value = [before.0[0] + 1.0];
    filter
        .observe_at(1.0, &Observation::new(&[0], &value))
        .unwrap();
    let after = moments(&mut filter);
    assert!(after.1[0] < 0.01 * before.1[0]);
    assert!((after.0[1] - before.0[1]).abs() < 1e-12);
    assert!((after.1[1] / before.1[1] - 1.0).abs() < 1e-12);
}

#[test]
fn independent_degrees_of_freedom_call_for_shrinkage() {
    let demonstrations = motions(4, 10, true);
    let unseen = motions(5, 40, true);
    let chosen = train(&demonstrations, Shrinkage::LeaveOneOut);
    println!("alpha {}", chosen.shrinkage());
    assert!(chosen.shrinkage() >= 0.3);
    let plain = train(&demonstrations, Shrinkage::None);
    let (with, without) = (
        held_out_density(&chosen, &unseen),
        held_out_density(&plain, &unseen),
    );
    assert!(with > without, "{with} {without}");
}

#[test]
fn dependent_degrees_of_freedom_do_not() {
    let demonstrations = motions(6, 12, false);
    let chosen = train(&demonstrations, Shrinkage::LeaveOneOut);
    assert!(chosen.shrinkage() <= 0.02, "{}", chosen.shrinkage());
}

#[test]
fn chosen_directions_are_bounded_after_shrinkage() {
    let demonstrations = motions(7, 10, true);
    for shrinkage in [Shrinkage::Fixed(0.5), Shrinkage::LeaveOneOut] {
        let full = train(&demonstrations, shrinkage);
        let config = TrainingConfig {
            max_rank: Some(12),
            ..config(shrinkage)
        };
        let few = Model::train(&demonstrations, &config).unwrap();
        assert_eq!(full.rank(), DOFS * COUNT);
        assert_eq!(few.rank(), 12);
        assert_eq!(few.shrinkage(), full.shrinkage());
        // What is dropped becomes noise.
        let (few, full) = (
            few.noise_held_out().unwrap(),
            full.noise_held_out().unwrap(),
        );
        assert!(few.iter().zip(full).all(|(a, b)| a >= b));
    }
}

#[test]
fn few_demonstrations() {
    let demonstrations = motions(8, 3, true);
    let one = train(&demonstrations[..1], Shrinkage::LeaveOneOut);
    assert_eq!((one.shrinkage(), one.rank()), (0.0, 0));
    let one = train(&demonstrations[..1], Shrinkage::Fixed(0.5));
    assert_eq!(one.rank(), 0);
    for count in [2, 3] {
        let model = train(&demonstrations[..count], Shrinkage::LeaveOneOut);
        assert!(
            model
                .noise_held_out()
                .unwrap()
                .iter()
                .all(|v| *v > 0.0 && v.is_finite())
        );
    }
}

#[test]
fn choosing_does_not_need_the_held_out_noise() {
    let demonstrations = motions(9, 10, true);
    let config = TrainingConfig {
        held_out: 0,
        ..config(Shrinkage::LeaveOneOut)
    };
    let model = Model::train(&demonstrations, &config).unwrap();
    assert_eq!(model.noise_held_out(), None);
    let with_noise = train(&demonstrations, Shrinkage::LeaveOneOut);
    assert_eq!(model.shrinkage(), with_noise.shrinkage());
}

/// The hand and the arm of the reference move together: `α` is small or zero.
#[test]
fn reference_workload() {
    let Some(reference) = common::reference() else {
        return;
    };
    let demonstrations = common::training_set(&reference);
    let config = TrainingConfig {
        shrinkage: Shrinkage::LeaveOneOut,
        ..TrainingConfig::new(common::groups(Basis::Legendre { count: 8 }))
    };
    let model = Model::train(&demonstrations, &config).unwrap();
    println!("alpha {}", model.shrinkage());
    assert!(model.shrinkage() <= 0.05);
}
