//! Known failures of other implementations, and input that must not break a filter.

use crate::common::{evaluate, moments, one_group, reaches, step, trained};
use hwall_bip::{
    ArgumentError, Basis, BipError, Demonstration, Filter, FilterConfig, Model, NoiseSource,
    Observation, TrainingConfig,
};
use hwall_testkit::Sampler;

fn filter(model: &Model) -> Filter {
    Filter::new(model, &FilterConfig::default()).unwrap()
}

/// Follows a motion to its end; checks that all numbers stay finite and returns the final error.
fn follow(filter: &mut Filter, motion: &Demonstration) -> f64 {
    let dofs: Vec<usize> = (0..motion.dofs()).collect();
    for k in 0..motion.len() {
        step(filter, &dofs, motion.sample(k));
        assert!((0.0..=1.0).contains(&filter.phase()));
    }
    let (mut mean, mut variance) = (vec![0.0; dofs.len()], vec![0.0; dofs.len()]);
    filter
        .moments_at(1.0, &dofs, &mut mean, &mut variance)
        .unwrap();
    assert!(variance.iter().all(|v| *v >= 0.0));
    mean.iter()
        .zip(motion.sample(motion.len() - 1))
        .fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
}

/// Symmetry holds by construction; a Cholesky factor must exist.
fn assert_positive_definite(p: &[f64]) {
    let n = (p.len() as f64).sqrt() as usize;
    let mut l = p.to_vec();
    for i in 0..n {
        for j in 0..=i {
            assert_eq!(p[i * n + j], p[j * n + i]);
            let sum: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
            let value = p[i * n + j] - sum;
            l[i * n + j] = if i == j {
                assert!(value > 0.0, "pivot {i} of {n} is {value:e}");
                value.sqrt()
            } else {
                value / l[j * n + j]
            };
        }
    }
}

#[test]
fn polynomial_at_exactly_half_phase() {
    for count in 1..=8 {
        let (values, slopes) = evaluate(Basis::Polynomial { count }, 0.5);
        for b in 0..count {
            assert_eq!(values[b], if b == 0 { 1.0 } else { 0.0 });
            assert_eq!(slopes[b], if b == 1 { 2.0 } else { 0.0 });
        }
    }
}

#[test]
fn every_basis_far_outside_the_motion() {
    for basis in [
        Basis::gaussian(6),
        Basis::normalized_gaussian(6),
        Basis::Sigmoid {
            count: 6,
            width: 1e-3,
        },
        Basis::Polynomial { count: 8 },
        Basis::Legendre { count: 8 },
        Basis::Chebyshev { count: 8 },
    ] {
        for phase in [-1e30, -1e4, -50.0, 50.0, 1e4, 1e30] {
            let (values, slopes) = evaluate(basis, phase);
            let mut all = values.iter().chain(&slopes);
            assert!(all.all(|x| x.is_finite()), "{basis:?}");
        }
        let (mut v, mut d) = (vec![0.0; basis.count()], vec![0.0; basis.count()]);
        let nan = basis.evaluate_into(f64::NAN, &mut v, &mut d);
        assert!(matches!(
            nan,
            Err(BipError::Argument(ArgumentError::NonFinite { .. }))
        ));
    }
}

#[test]
fn overflow_of_a_polynomial_is_an_error_and_changes_nothing() {
    let model = trained(&reaches(1, 5, 2), Basis::Polynomial { count: 6 });
    let mut filter = filter(&model);
    let before = (filter.phase(), filter.covariance());
    let result = filter.observe_at(1e200, &Observation::new(&[0], &[0.0]));
    assert_eq!(result, Err(BipError::Overflow { phase: 1e200 }));
    assert_eq!(before, (filter.phase(), filter.covariance()));
    let (mut mean, mut variance) = ([0.0], [0.0]);
    let result = filter.moments_at(1e200, &[0], &mut mean, &mut variance);
    assert_eq!(result, Err(BipError::Overflow { phase: 1e200 }));
}

#[test]
fn answers_do_not_depend_on_what_was_asked_before() {
    let demonstrations = reaches(2, 8, 3);
    let model = trained(&demonstrations, Basis::normalized_gaussian(6));
    let (mut plain, mut asked) = (filter(&model), filter(&model));
    for k in 0..30 {
        for f in [&mut plain, &mut asked] {
            step(f, &[0, 1, 2], demonstrations[0].sample(k));
        }
        moments(&mut asked, 0.123 * k as f64, [0, 1, 2]);
        let _ = asked.time_to_end();
        let _ = asked.observe(&Observation::new(&[0], &[f64::NAN]));
        assert_eq!(plain.phase(), asked.phase());
    }
    assert_eq!(plain.covariance(), asked.covariance());
}

#[test]
fn repeated_identical_frames() {
    let demonstrations = reaches(3, 8, 3);
    let model = trained(&demonstrations, Basis::Legendre { count: 6 });
    let mut filter = filter(&model);
    // Also without time between the frames: a tracker that sends every frame twice.
    for dt in [1.0, 0.0] {
        for _ in 0..2_000 {
            filter.predict(dt).unwrap();
            filter
                .observe(&Observation::new(&[0, 1, 2], demonstrations[1].sample(10)))
                .unwrap();
        }
        assert_positive_definite(&filter.covariance());
    }
}

#[test]
fn observation_with_everything_missing() {
    let model = trained(&reaches(4, 6, 2), Basis::Legendre { count: 5 });
    let mut filter = filter(&model);
    filter.predict(3.0).unwrap();
    let before = filter.covariance();
    let update = filter.observe(&Observation::new(&[], &[])).unwrap();
    assert_eq!(update.rows, 0);
    assert_eq!((update.distance_squared, update.log_likelihood), (0.0, 0.0));
    assert_eq!(before, filter.covariance());
    let update = filter
        .observe_at(1.0, &Observation::new(&[], &[]).with_covariance(&[]))
        .unwrap();
    assert_eq!(update.rows, 0);
}

#[test]
fn a_single_demonstration_still_finds_the_phase() {
    let demonstrations = reaches(5, 1, 3);
    let model = trained(&demonstrations, Basis::Legendre { count: 8 });
    assert_eq!(model.rank(), 0);
    assert!(model.noise_held_out().is_none());
    let held_out = FilterConfig {
        noise: NoiseSource::HeldOut,
        ..FilterConfig::default()
    };
    let refused = Filter::new(&model, &held_out).err();
    let too_few = BipError::TooFewDemonstrations { needed: 2, got: 1 };
    assert_eq!(refused, Some(too_few));
    let mut filter = filter(&model);
    let motion = &demonstrations[0];
    for k in 0..motion.len() / 2 {
        filter.predict(1.1).unwrap(); // a tenth faster than demonstrated
        filter
            .observe(&Observation::new(&[0, 1, 2], motion.sample(k)))
            .unwrap();
    }
    let truth = motion.phase(motion.len() / 2 - 1);
    assert!((filter.phase() - truth).abs() < 0.02, "{}", filter.phase());
}

/// Few and many demonstrations and degrees of freedom: the number of directions is the least of demonstrations minus one, weights, and the
/// requested rank.
#[test]
fn directions_of_few_and_of_many() {
    for (seed, count, dofs, functions, max_rank, rank) in [
        (6, 3, 4, 9, None, 2),
        (20, 2_000, 3, 6, None, 18),
        (22, 12, 100, 6, None, 11),
        (23, 12, 4, 6, Some(3), 3),
    ] {
        let demonstrations = reaches(seed, count, dofs);
        let config = TrainingConfig {
            max_rank,
            ..one_group(dofs, Basis::Legendre { count: functions })
        };
        let model = Model::train(&demonstrations, &config).unwrap();
        assert_eq!(model.rank(), rank);
        let error = follow(&mut filter(&model), &demonstrations[2]);
        assert!(
            max_rank.is_some() || error < 0.02,
            "{count} of {dofs}: {error}"
        );
    }
}

#[test]
fn fewer_samples_than_functions() {
    let values = vec![0.0, 0.2, 0.5, 0.9];
    let short = Demonstration::from_samples(1.0, 1, values).unwrap();
    let model = trained(&[short.clone(), short], Basis::Legendre { count: 9 });
    let mut mean = [0.0];
    model.mean_at(1.0, &mut mean).unwrap();
    assert!((mean[0] - 0.9).abs() < 1e-9, "{}", mean[0]);
}

#[test]
fn demonstrations_of_very_different_lengths() {
    let mut demonstrations = reaches(7, 6, 2);
    let slow = &demonstrations[0];
    let mut stretched = Vec::new();
    for k in 0..slow.len() {
        for _ in 0..20 {
            stretched.extend_from_slice(slow.sample(k));
        }
    }
    demonstrations.push(Demonstration::from_samples(1.0, 2, stretched).unwrap());
    demonstrations.push(Demonstration::from_samples(1.0, 2, vec![0.0, 0.1, 0.5, 0.6]).unwrap());
    let model = trained(&demonstrations, Basis::Legendre { count: 6 });
    // The phase velocities span a factor of 300, so their prior is almost uninformative.
    let error = follow(&mut filter(&model), &demonstrations[3]);
    assert!(error < 0.05, "{error}");
}

#[test]
fn constant_columns() {
    let mut demonstrations = Vec::new();
    for motion in reaches(8, 6, 2) {
        let values = (0..motion.len())
            .flat_map(|k| {
                let x = motion.sample(k);
                [x[0], 0.0, x[1], 4.25]
            })
            .collect();
        demonstrations.push(Demonstration::from_samples(1.0, 4, values).unwrap());
    }
    // Plain Gaussians fit the rest at the end of a reach badly, which is irrelevant here.
    for (basis, allowed) in [
        (Basis::Legendre { count: 6 }, 0.01),
        (Basis::gaussian(6), 0.03),
    ] {
        let model = trained(&demonstrations, basis);
        let mut f = filter(&model);
        let error = follow(&mut f, &demonstrations[0]);
        assert!(error < allowed, "{basis:?}: {error}");
        let [mean, variance] = moments(&mut f, 0.4, [1, 3]);
        assert!(mean[0].abs() < 1e-9 && (mean[1] - 4.25).abs() < 1e-9);
        assert!(variance.iter().all(|v| *v < 1e-15));
        // A constant value may change without the filter losing the motion.
        f.observe(&Observation::new(&[3], &[5.0])).unwrap();
        assert!(f.phase().is_finite());
    }
}

#[test]
fn nan_and_infinity_are_named_by_place() {
    for (value, name) in [(f64::NAN, "NaN"), (f64::NEG_INFINITY, "-inf")] {
        let mut values = vec![0.0; 30];
        values[3 * 7 + 2] = value;
        let error = Demonstration::from_samples(1.0, 3, values).unwrap_err();
        let said = format!("row 7, column 2 is {name}, not a finite number");
        assert_eq!(error.to_string(), said);
    }
}

#[test]
fn time_stamps_that_repeat_or_go_back() {
    for (times, row) in [(vec![0.0, 1.0, 1.0, 2.0], 2), (vec![0.0, 1.0, 2.0, 1.5], 3)] {
        let error = Demonstration::from_timestamps(times, 1, vec![0.0; 4]).unwrap_err();
        assert!(matches!(error, BipError::TimeNotIncreasing { row: r, .. } if r == row));
    }
    let nan = Demonstration::from_timestamps(vec![0.0, f64::NAN], 1, vec![0.0; 2]);
    assert!(matches!(
        nan,
        Err(BipError::Argument(ArgumentError::NonFinite {
            index: Some(1),
            ..
        }))
    ));
}

#[test]
fn malformed_input_is_a_typed_error() {
    let short = Demonstration::from_samples(1.0, 2, vec![0.0, 1.0]);
    assert_eq!(short, Err(BipError::TooShort { samples: 1 }));
    for (period, dofs, values) in [(1.0, 2, 5), (0.0, 1, 5), (1.0, 0, 0)] {
        assert!(Demonstration::from_samples(period, dofs, vec![0.0; values]).is_err());
    }
    let demonstrations = reaches(9, 3, 2);
    let train = |count: usize, dofs: usize, functions: usize| {
        let basis = Basis::Legendre { count: functions };
        Model::train(&demonstrations[..count], &one_group(dofs, basis))
    };
    assert!(train(3, 2, 0).is_err() && train(0, 2, 4).is_err());
    let other_dofs = BipError::DofMismatch {
        demonstration: 0,
        expected: 3,
        got: 2,
    };
    assert_eq!(train(3, 3, 4), Err(other_dofs));
    let mut f = filter(&train(3, 2, 4).unwrap());
    let unknown = f.observe(&Observation::new(&[2], &[0.0]));
    assert_eq!(unknown, Err(BipError::UnknownDof { dof: 2, dofs: 2 }));
    let twice = f.observe(&Observation::new(&[1, 1], &[0.0, 0.0]));
    assert_eq!(twice, Err(BipError::DuplicateDof { dof: 1 }));
    assert!(f.observe(&Observation::new(&[0, 1], &[0.0])).is_err());
    let one = Observation::new(&[0], &[0.0]);
    assert!(f.observe(&one.with_variances(&[0.0])).is_err());
    let indefinite = [1.0, 2.0, 2.0, 1.0];
    let both = Observation::new(&[0, 1], &[0.0, 0.0]);
    assert!(matches!(
        f.observe(&both.with_covariance(&indefinite)),
        Err(BipError::NotPositiveDefinite { pivot: 1, .. })
    ));
    for dt in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(f.predict(dt).is_err());
    }
    assert!(f.observe_phase(0.5, 0.0).is_err());
}

#[test]
fn nearly_identical_demonstrations() {
    let motion = reaches(10, 1, 3).remove(0);
    let mut sampler = Sampler::new(11);
    for size in [0.0, 1e-15, 1e-9] {
        let copies: Vec<_> = (0..6)
            .map(|_| {
                let values = (0..motion.len())
                    .flat_map(|k| motion.sample(k).to_vec())
                    .map(|x| x + size * sampler.normal())
                    .collect();
                Demonstration::from_samples(1.0, 3, values).unwrap()
            })
            .collect();
        let model = trained(&copies, Basis::Legendre { count: 7 });
        assert!(model.rank() <= 5);
        let mut f = filter(&model);
        assert!(follow(&mut f, &motion) < 0.01);
        assert_positive_definite(&f.covariance());
    }
}

#[test]
fn ill_conditioned_basis_keeps_its_head() {
    // Condition number near 1e9: the full filter goes to 1e6 m in weight space.
    let wide = Basis::Gaussian {
        count: 12,
        variance: 0.07,
    };
    let demonstrations = reaches(13, 20, 3);
    let model = trained(&demonstrations, wide);
    let mut f = filter(&model);
    let error = follow(&mut f, &reaches(14, 1, 3)[0]);
    assert!(error < 0.02, "{error}");
    assert_positive_definite(&f.covariance());
}

#[test]
fn irregular_frames_and_dropped_points() {
    let demonstrations = reaches(15, 12, 3);
    let model = trained(&demonstrations, Basis::Legendre { count: 7 });
    let unseen = &reaches(16, 1, 3)[0];
    let mut sampler = Sampler::new(17);
    let mut f = filter(&model);
    let mut since = 0.0;
    for k in 0..unseen.len() {
        since += 1.0;
        if sampler.uniform(0.0, 1.0) < 0.3 {
            continue; // frame lost
        }
        f.predict(since).unwrap();
        since = 0.0;
        let (mut dofs, mut values) = (Vec::new(), Vec::new());
        for (d, x) in unseen.sample(k).iter().enumerate() {
            if sampler.bool() {
                dofs.push(d);
                values.push(*x);
            }
        }
        f.observe(&Observation::new(&dofs, &values)).unwrap();
    }
    let [mean, _] = moments(&mut f, 1.0, [0, 1, 2]);
    for (mean, truth) in mean.iter().zip(unseen.sample(unseen.len() - 1)) {
        assert!((mean - truth).abs() < 0.03, "{mean} {truth}");
    }
}

#[test]
fn a_million_updates_stay_positive_definite() {
    let model = trained(&reaches(18, 7, 3), Basis::Legendre { count: 5 });
    let mut f = filter(&model);
    let mut sampler = Sampler::new(19);
    let all = [0, 1, 2];
    for i in 0..1_000_000_u32 {
        f.predict(sampler.uniform(0.0, 2.0)).unwrap();
        let values = [0; 3].map(|_| sampler.uniform(-0.5, 1.5));
        let seen = sampler.index(4);
        let observation = Observation::new(&all[..seen], &values[..seen]);
        match i % 50 {
            0 => f.observe_phase(sampler.uniform(0.0, 1.0), 1e-2),
            1 => f.observe_at(sampler.uniform(0.0, 1.0), &observation),
            _ => f.observe(&observation),
        }
        .unwrap();
        if i % 50_000 == 0 {
            assert_positive_definite(&f.covariance());
        }
    }
    assert_positive_definite(&f.covariance());
    assert!(f.coefficients().all(f64::is_finite));
}
