//! Adding and removing demonstrations, compared with training on the rest.

use crate::common::{one_group, trained};
use hwall_bip::{
    ArgumentError, Basis, BipError, Demonstration, Group, Model, Onset, Trainer, TrainingConfig,
};
use hwall_testkit::Sampler;

/// Smooth motions far from zero, of different lengths, irregularly sampled.
fn motions(seed: u64, count: usize, dofs: usize) -> Vec<Demonstration> {
    let mut sampler = Sampler::new(seed);
    (0..count)
        .map(|_| {
            let shape: Vec<[f64; 3]> = (0..dofs)
                .map(|_| [0; 3].map(|_| sampler.normal()))
                .collect();
            let samples = 20 + sampler.index(60);
            let mut time = 0.0;
            let (mut times, mut values) = (Vec::new(), Vec::new());
            for _ in 0..samples {
                times.push(time);
                time += sampler.uniform(0.5, 1.5);
            }
            for t in times.iter().map(|t| t / times[samples - 1]) {
                for (d, [a, b, c]) in shape.iter().enumerate() {
                    let smooth = 5.0 * d as f64 + a * t + b * t * t + 0.3 * c * (4.0 * t).sin();
                    values.push(smooth + 0.01 * sampler.normal());
                }
            }
            Demonstration::from_timestamps(times, dofs, values).unwrap()
        })
        .collect()
}

/// Bases with and without the constant, and two groups.
fn configs() -> Vec<TrainingConfig> {
    let mut configs = Vec::new();
    for basis in [
        Basis::gaussian(6),
        Basis::Sigmoid {
            count: 5,
            width: 0.1,
        },
        Basis::Legendre { count: 7 },
        Basis::normalized_gaussian(8),
    ] {
        let groups = vec![
            Group::observed("hand", 3, basis),
            Group::controlled("arm", 2, Basis::Legendre { count: 5 }),
        ];
        let config = TrainingConfig::new(groups.clone());
        configs.push(TrainingConfig {
            max_rank: Some(4),
            ..config.clone()
        });
        configs.push(config);
        configs.push(TrainingConfig::published(groups));
    }
    configs
}

fn covariance(model: &Model) -> Vec<f64> {
    let prior = model.to_prior();
    let rows: Vec<&[f64]> = prior.factor.chunks_exact(prior.rank.max(1)).collect();
    let entry = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum();
    rows.iter()
        .flat_map(|a| rows.iter().map(move |b| entry(a, b)))
        .collect()
}

fn close(what: &str, a: &[f64], b: &[f64], relative: f64) {
    assert_eq!(a.len(), b.len(), "{what}");
    let size = a.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() <= relative * size, "{what}[{i}]: {a} {b}");
    }
}

/// Signs and rotations of the factor are arbitrary; everything else is not.
fn assert_same(a: &Model, b: &Model, relative: f64) {
    assert_eq!(a.rank(), b.rank());
    assert_eq!(a.demonstrations(), b.demonstrations());
    close("offset", a.offset(), b.offset(), relative);
    close("mean", &a.to_prior().mean, &b.to_prior().mean, relative);
    close("covariance", &covariance(a), &covariance(b), relative);
    close("noise", a.noise_fit(), b.noise_fit(), relative);
    let (x, y) = (a.noise_held_out().unwrap(), b.noise_held_out().unwrap());
    close("held-out noise", x, y, relative);
    let (x, y) = (a.phase_velocity(), b.phase_velocity());
    close("velocity", &[x.mean], &[y.mean], relative);
    close("velocity", &[x.variance], &[y.variance], relative);
    let (x, y) = (a.sampling_period(), b.sampling_period());
    close("period", &[x], &[y], relative);
}

#[test]
fn adding_all_and_removing_some_is_training_on_the_rest() {
    let demonstrations = motions(1, 14, 5);
    for config in configs() {
        let mut trainer = Trainer::new(config.clone()).unwrap();
        let ids: Vec<_> = demonstrations
            .iter()
            .map(|d| trainer.add(d).unwrap())
            .collect();
        for i in [0, 13, 5, 6] {
            trainer.remove(ids[i]).unwrap();
        }
        assert_eq!(trainer.len(), 10);
        let rest: Vec<_> = (0..14)
            .filter(|i| ![0, 13, 5, 6].contains(i))
            .map(|i| demonstrations[i].clone())
            .collect();
        let trained = Model::train(&rest, &config).unwrap();
        assert_same(&trainer.model().unwrap(), &trained, 1e-10);
        assert_eq!(trainer.model().unwrap(), trained); // bit-identical

        // Add them again, at another position: only the order differs.
        for i in [6, 0, 13, 5] {
            trainer.add(&demonstrations[i]).unwrap();
        }
        let all = Model::train(&demonstrations, &config).unwrap();
        assert_same(&trainer.model().unwrap(), &all, 1e-10);
    }
}

#[test]
fn offset_far_away_costs_no_digits() {
    // The same motions a thousand units away from zero.
    let near = motions(4, 8, 3);
    let far: Vec<_> = near
        .iter()
        .map(|d| {
            let values = (0..d.len()).flat_map(|k| d.sample(k)).map(|x| x + 1024.0);
            Demonstration::from_timestamps(d.times().to_vec(), 3, values.collect()).unwrap()
        })
        .collect();
    let [near, far] = [near, far].map(|motions| trained(&motions, Basis::gaussian(6)));
    close("mean", &near.to_prior().mean, &far.to_prior().mean, 1e-10);
    close("covariance", &covariance(&near), &covariance(&far), 1e-10);
    close("noise", near.noise_fit(), far.noise_fit(), 1e-9);
}

#[test]
fn shared_decomposition_is_the_direct_one() {
    // A rank bound without effect takes the direct path: one decomposition per held-out demonstration. The cases are more and fewer demonstrations
    // than weights, two demonstrations, and one that alone moves a degree of freedom.
    for count in [2, 3, 9, 80] {
        let demonstrations: Vec<_> = motions(5, count, 4)
            .iter()
            .enumerate()
            .map(|(i, d)| {
                let values = (0..d.len()).flat_map(|k| {
                    let x = d.sample(k);
                    [x[0], x[1], x[2], if i == 1 { x[3] } else { 15.0 }]
                });
                Demonstration::from_timestamps(d.times().to_vec(), 4, values.collect()).unwrap()
            })
            .collect();
        let config = one_group(4, Basis::Legendre { count: 5 });
        let direct = TrainingConfig {
            max_rank: Some(1000),
            ..config.clone()
        };
        let shared = Model::train(&demonstrations, &config).unwrap();
        let direct = Model::train(&demonstrations, &direct).unwrap();
        assert_same(&shared, &direct, 1e-9);
    }
}

#[test]
fn errors_name_what_is_wrong_and_change_nothing() {
    let demonstrations = motions(6, 3, 3);
    let config = one_group(3, Basis::gaussian(4));
    let mut trainer = Trainer::new(config.clone()).unwrap();
    let none = Err(BipError::TooFewDemonstrations { needed: 1, got: 0 });
    assert!(trainer.is_empty());
    assert_eq!(trainer.model(), none);
    let first = trainer.add(&demonstrations[0]).unwrap();
    let second = trainer.add(&demonstrations[1]).unwrap();
    let refused = BipError::DofMismatch {
        demonstration: 2,
        expected: 3,
        got: 2,
    };
    assert_eq!(trainer.add(&motions(6, 1, 2)[0]), Err(refused));
    trainer.remove(first).unwrap();
    let gone = Err(BipError::UnknownDemonstration { id: 0 });
    assert_eq!(trainer.remove(first), gone);
    assert_eq!(trainer.len(), 1);
    let third = trainer.add(&demonstrations[2]).unwrap();
    assert!(third != first && third != second); // numbers are never reused
    assert_eq!(trainer.remove(first), gone);
    trainer.remove(second).unwrap();
    trainer.remove(third).unwrap();
    assert_eq!(trainer.model(), none);

    let result = Trainer::new(TrainingConfig {
        onset: Some(Onset::new([])),
        ..config.clone()
    });
    assert!(matches!(result, Err(BipError::WrongLength { .. })));
    let huge = Basis::Legendre { count: usize::MAX };
    let result = Trainer::new(one_group(3, huge));
    assert!(matches!(
        result,
        Err(BipError::Argument(ArgumentError::OutOfRange { .. }))
    ));
}

#[test]
fn values_near_the_largest_double_are_an_error_not_a_nan() {
    let demonstrations: Vec<_> = (0..3)
        .map(|i| {
            let values = (0..20).map(|k| if (k + i) % 2 == 0 { 1.7e308 } else { -1.7e308 });
            Demonstration::from_samples(1.0, 1, values.collect()).unwrap()
        })
        .collect();
    let result = Model::train(&demonstrations, &one_group(1, Basis::gaussian(4)));
    assert!(result.is_err(), "{result:?}");
}
