//! The ensemble filter: against the exact one, against the textbook update of its own sample, and on missing or broken input.

use crate::common::{
    HAND, csv, cubics, evaluate, groups, moments, reference, step, trained, training_set,
};
use hwall_bip::{
    ArgumentError, Basis, BipError, Demonstration, EnsembleConfig, EnsembleFilter, EnsembleUpdate,
    Filter, FilterConfig, Group, Model, MotionFilter, NoiseSource, Observation, PhaseVelocity,
    Prior, TrainingConfig,
};

const ALL: [EnsembleUpdate; 2] = [EnsembleUpdate::Perturbed, EnsembleUpdate::Deterministic];

fn model() -> Model {
    let groups = vec![
        Group::observed("hand", 2, Basis::Legendre { count: 5 }),
        Group::controlled("arm", 1, Basis::normalized_gaussian(4)),
    ];
    Model::train(&cubics(1, 7, 3, 0.01), &TrainingConfig::new(groups)).unwrap()
}

/// The model of [`model`] with a practically known phase.
fn model_of_known_phase() -> Model {
    Model::from_prior(&Prior {
        phase_velocity: PhaseVelocity {
            mean: 0.02,
            variance: 1e-20,
        },
        ..model().to_prior()
    })
    .unwrap()
}

fn known_phase() -> FilterConfig {
    FilterConfig {
        phase: 0.1,
        phase_variance: 1e-20,
        acceleration_variance: Some(0.0),
        noise: NoiseSource::Fit,
        ..FilterConfig::default()
    }
}

fn ensemble(model: &Model, members: usize, update: EnsembleUpdate) -> EnsembleFilter {
    let config = EnsembleConfig {
        members,
        seed: 3,
        update,
        ..EnsembleConfig::default()
    };
    EnsembleFilter::new(model, &config).unwrap()
}

/// All outputs of a filter, for bitwise comparison.
fn bits(filter: &EnsembleFilter) -> Vec<u64> {
    filter
        .coefficients()
        .chain(filter.covariance())
        .chain(filter.phases().iter().copied())
        .chain([filter.phase(), filter.phase_velocity()])
        .map(f64::to_bits)
        .collect()
}

fn run(filter: &mut EnsembleFilter, motion: &Demonstration, steps: usize) {
    for k in 0..steps {
        filter.predict([1.0, 0.3, 2.0][k % 3]).unwrap();
        let y = &motion.sample(k)[..2];
        filter.observe(&Observation::new(&[0, 1], y)).unwrap();
    }
}

#[test]
fn same_seed_same_answer() {
    let (model, motion) = (model(), &cubics(2, 1, 3, 0.01)[0]);
    for update in ALL {
        let [first, again, other] = [3, 3, 4].map(|seed| {
            let config = EnsembleConfig {
                members: 21,
                seed,
                update,
                ..EnsembleConfig::default()
            };
            let mut filter = EnsembleFilter::new(&model, &config).unwrap();
            run(&mut filter, motion, 20);
            bits(&filter)
        });
        assert_eq!(first, again, "{update:?}");
        assert_ne!(first, other, "{update:?}");
    }
}

/// With a known phase the problem is linear and the exact filter is exact. Standard deviations may differ by the sampling error
/// `sd / √(2 members)`, means by several `sd / √members`, because the sampling error of the gain multiplies innovations of several standard
/// deviations.
#[test]
fn many_members_agree_with_the_exact_filter() {
    let (model, motion) = (model_of_known_phase(), &cubics(2, 1, 3, 0.01)[0]);
    for update in ALL {
        let mut exact = Filter::new(&model, &known_phase()).unwrap();
        let config = EnsembleConfig {
            members: 4000,
            seed: 5,
            update,
            filter: known_phase(),
        };
        let mut sample = EnsembleFilter::new(&model, &config).unwrap();
        for k in 5..25 {
            exact.predict(1.0).unwrap();
            sample.predict(1.0).unwrap();
            let y = &motion.sample(k)[..2];
            let (a, b) = (
                exact.observe(&Observation::new(&[0, 1], y)).unwrap(),
                sample.observe(&Observation::new(&[0, 1], y)).unwrap(),
            );
            assert!((exact.phase() - sample.phase()).abs() < 1e-9);
            assert!((a.log_likelihood - b.log_likelihood).abs() < 1.0, "{k}");
            let [m, v] = moments(&mut exact, 0.9, [0, 1, 2]);
            let [m2, v2] = moments(&mut sample, 0.9, [0, 1, 2]);
            for d in 0..3 {
                let z = (m2[d] - m[d]) / (v[d] / 4000.0).sqrt();
                let ratio = (v2[d] / v[d]).sqrt();
                assert!(z.abs() < 25.0, "{update:?} step {k}: {z} sampling errors");
                let off = ratio - 1.0;
                assert!(off.abs() < 5.0 / 8000.0_f64.sqrt(), "{update:?} {ratio}");
            }
        }
    }
}

/// Row of the measurement matrix on `[phase, velocity, c]` at a given phase, and the prediction for `c = 0`.
fn row(model: &Model, dof: usize, phase: f64) -> (f64, Vec<f64>) {
    let prior = model.to_prior();
    let mut first = 0;
    let bases = prior.groups.iter().flat_map(|g| vec![g.basis; g.dofs]);
    for (d, basis) in bases.enumerate() {
        let count = basis.count();
        if d < dof {
            first += count;
            continue;
        }
        let (values, _) = evaluate(basis, phase);
        let mut h = vec![0.0; 2 + prior.rank];
        let mut mean = model.offset()[dof];
        for (b, v) in values.iter().enumerate() {
            mean += v * prior.mean[first + b];
            for c in 0..prior.rank {
                h[2 + c] += v * prior.factor[(first + b) * prior.rank + c];
            }
        }
        return (mean, h);
    }
    unreachable!()
}

/// Evidence at a fixed phase is linear: the mean and covariance of the members after it are the Kalman update of those before it, for any number
/// of members and for diagonal or full noise.
#[test]
fn deterministic_update_is_the_textbook_one_for_the_sample() {
    let (model, motion) = (model(), &cubics(2, 1, 3, 0.01)[0]);
    let full = [4e-4, 1e-4, 1e-4, 9e-4];
    for (members, covariance) in [(3, false), (5, true), (17, false), (64, true)] {
        let mut filter = ensemble(&model, members, EnsembleUpdate::Deterministic);
        run(&mut filter, motion, 3);
        let state = |f: &EnsembleFilter| -> Vec<f64> {
            [f.phase(), f.phase_velocity()]
                .into_iter()
                .chain(f.coefficients())
                .collect()
        };
        let (x, p) = (state(&filter), filter.covariance());
        let n = x.len();
        let rows: Vec<(f64, Vec<f64>)> = [2, 0].map(|d| row(&model, d, 0.7)).to_vec();
        let y = [0.8, 0.6];
        let observation = Observation::new(&[2, 0], &y);
        let (r, observation) = if covariance {
            (full, observation.with_covariance(&full))
        } else {
            (
                [full[0], 0.0, 0.0, full[3]],
                observation.with_variances(&[4e-4, 9e-4]),
            )
        };
        let update = filter.observe_at(0.7, &observation).unwrap();
        let (after, p_after) = (state(&filter), filter.covariance());

        let times = |m: &[f64], v: &[f64]| -> Vec<f64> {
            m.chunks(n)
                .map(|row| row.iter().zip(v).map(|(a, b)| a * b).sum())
                .collect()
        };
        let ph: Vec<Vec<f64>> = rows.iter().map(|(_, h)| times(&p, h)).collect();
        let inner =
            |i: usize, v: &[f64]| -> f64 { rows[i].1.iter().zip(v).map(|(a, b)| a * b).sum() };
        let s = [
            inner(0, &ph[0]) + r[0],
            inner(0, &ph[1]) + r[1],
            inner(1, &ph[0]) + r[2],
            inner(1, &ph[1]) + r[3],
        ];
        let det = s[0] * s[3] - s[1] * s[2];
        let inverse = [s[3] / det, -s[1] / det, -s[2] / det, s[0] / det];
        let e = [0, 1].map(|i| y[i] - rows[i].0 - inner(i, &x));
        let gain: Vec<[f64; 2]> = (0..n)
            .map(|k| [0, 1].map(|j| ph[0][k] * inverse[j] + ph[1][k] * inverse[2 + j]))
            .collect();
        for k in 0..n {
            let want = x[k] + gain[k][0] * e[0] + gain[k][1] * e[1];
            assert!((after[k] - want).abs() < 1e-9, "{members}: mean {k}");
            for l in 0..n {
                let want = p[k * n + l] - gain[k][0] * ph[0][l] - gain[k][1] * ph[1][l];
                let got = p_after[k * n + l];
                assert!((got - want).abs() < 1e-9, "{members}: {got} {want}");
            }
        }
        let distance = (0..4)
            .map(|ij| e[ij / 2] * inverse[ij] * e[ij % 2])
            .sum::<f64>();
        let likelihood = -0.5 * (distance + det.ln()) - std::f64::consts::TAU.ln();
        assert!((update.distance_squared / distance - 1.0).abs() < 1e-9);
        assert!((update.log_likelihood - likelihood).abs() < 1e-9 * distance.max(1.0));
    }
}

#[test]
fn full_covariance_that_is_diagonal_is_the_same_as_variances() {
    let model = model();
    for update in ALL {
        let (mut a, mut b) = (ensemble(&model, 12, update), ensemble(&model, 12, update));
        let observation = Observation::new(&[2, 0], &[0.4, 0.3]);
        let first = a
            .observe(&observation.with_variances(&[0.01, 0.02]))
            .unwrap();
        let second = b
            .observe(&observation.with_covariance(&[0.01, 0.0, 0.0, 0.02]))
            .unwrap();
        assert!((first.log_likelihood - second.log_likelihood).abs() < 1e-9);
        for (x, y) in a.coefficients().zip(b.coefficients()) {
            assert!((x - y).abs() < 1e-12, "{update:?}");
        }
    }
}

#[test]
fn nothing_observed_changes_nothing() {
    let model = model();
    for update in ALL {
        let mut filter = ensemble(&model, 9, update);
        let before = bits(&filter);
        let seen = filter.observe(&Observation::new(&[], &[])).unwrap();
        assert_eq!((seen.rows, seen.log_likelihood), (0, 0.0));
        assert_eq!(before, bits(&filter));
        filter.predict(0.0).unwrap();
        assert_eq!(before, bits(&filter));
    }
}

/// The members and the random generator are unchanged: the next good observation gives the same result.
#[test]
fn errors_leave_members_and_draws_as_they_were() {
    let model = model();
    for update in ALL {
        let mut filter = ensemble(&model, 9, update);
        filter.predict(1.0).unwrap();
        let (before, mut untouched) = (bits(&filter), filter.clone());
        for value in [f64::NAN, f64::INFINITY] {
            let error = filter.observe(&Observation::new(&[0, 1], &[0.1, value]));
            assert!(matches!(
                error,
                Err(BipError::Argument(ArgumentError::NonFinite {
                    what: "values",
                    ..
                }))
            ));
        }
        let good = [0.1, 0.2];
        let observation = Observation::new(&[0, 1], &good);
        for error in [
            filter.observe(&Observation::new(&[3], &[0.0])),
            filter.observe(&Observation::new(&[1, 1], &good)),
            filter.observe(&Observation::new(&[1], &good)),
            filter.observe(&observation.with_variances(&[0.1, 0.0])),
            filter.observe(&observation.with_covariance(&[1.0, 2.0, 2.0, 1.0])),
            filter.observe_at(f64::NAN, &observation),
            filter.observe_at(1e200, &observation),
            filter.observe(&Observation::new(&[0, 1], &[1e308, -1e308])),
        ] {
            assert!(error.is_err());
        }
        for dt in [-1.0, f64::NAN, f64::INFINITY, 1e308] {
            assert!(filter.predict(dt).is_err(), "{dt}");
        }
        let unknown = filter.moments_at(0.5, &[3], &mut [0.0], &mut [0.0]);
        assert!(unknown.is_err());
        assert_eq!(before, bits(&filter));
        let [seen, expected] = [&mut filter, &mut untouched].map(|filter| {
            filter.predict(1.0).unwrap();
            (filter.observe(&observation).unwrap(), bits(filter))
        });
        assert_eq!(seen, expected);
    }
}

#[test]
fn two_members_are_enough_and_one_is_not() {
    let (model, motion) = (model(), &cubics(2, 1, 3, 0.01)[0]);
    for members in [0, 1] {
        let config = EnsembleConfig {
            members,
            ..EnsembleConfig::default()
        };
        assert!(matches!(
            EnsembleFilter::new(&model, &config),
            Err(BipError::Argument(ArgumentError::OutOfRange {
                what: "members",
                ..
            }))
        ));
    }
    for update in ALL {
        for members in 2..20 {
            let mut filter = ensemble(&model, members, update);
            run(&mut filter, motion, motion.len());
            assert!((0.0..=1.0).contains(&filter.phase()));
            assert!(filter.covariance().iter().all(|x| x.is_finite()));
            assert_eq!(filter.phases().len(), members);
        }
    }
}

/// A single demonstration has no coefficients: only the phase is filtered.
#[test]
fn single_demonstration_filters_the_phase() {
    let demonstrations = cubics(3, 1, 3, 0.01);
    let model = trained(&demonstrations, Basis::Legendre { count: 5 });
    let motion = &demonstrations[0];
    for update in ALL {
        let mut filter = ensemble(&model, 200, update);
        for k in 0..motion.len() / 2 {
            step(&mut filter, &[0, 1, 2], motion.sample(k));
        }
        assert!((filter.phase() - 0.5).abs() < 0.05, "{}", filter.phase());
    }
}

#[test]
fn first_members_have_the_prior_as_their_mean() {
    let model = model();
    let filter = ensemble(&model, 11, EnsembleUpdate::Perturbed);
    assert!(filter.phase().abs() < 1e-15);
    assert!((filter.phase_velocity() / model.phase_velocity().mean - 1.0).abs() < 1e-14);
    assert!(filter.coefficients().all(|c| c.abs() < 1e-14));
    let drawn = ensemble(&model, 40_000, EnsembleUpdate::Perturbed);
    let p = drawn.covariance();
    let n = 2 + model.rank();
    for k in 2..n {
        for l in 2..n {
            let want = if k == l { 1.0 } else { 0.0 };
            assert!((p[k * n + l] - want).abs() < 0.05);
        }
    }
    let [[a, b], [c, d]] = drawn.phase_covariance();
    assert!((a / 1e-4 - 1.0).abs() < 0.05 && b == c);
    assert!((d / model.phase_velocity().variance - 1.0).abs() < 0.05);
}

/// Mean distance of the inferred end of the palm from the true one, mm, over the 18 ordinary
/// motions of the workload, with 30, 50, 80 and 100 % observed. `start` makes a filter for a motion.
fn palm_errors_mm<F: MotionFilter>(start: impl Fn(u64) -> F) -> [f64; 4] {
    let reference = reference().unwrap();
    let mut sums = [0.0; 4];
    for id in 0..18 {
        let samples = csv(&reference.join(format!("workload/test_{id:03}.csv")));
        let truth = &samples[samples.len() - 1];
        let mut filter = start(id);
        for (k, sample) in samples.iter().enumerate() {
            step(&mut filter, &HAND, &sample[..18]);
            let [palm, _] = moments(&mut filter, 1.0, [0, 1, 2]);
            let squares = palm.iter().zip(truth).map(|(a, b)| (a - b).powi(2));
            let error_mm = 1e3 * squares.sum::<f64>().sqrt();
            for (sum, share) in sums.iter_mut().zip([0.3, 0.5, 0.8, 1.0]) {
                if k + 1 == (samples.len() as f64 * share).round() as usize {
                    *sum += error_mm / 18.0;
                }
            }
        }
    }
    sums
}

/// With enough members the ensemble is about as good as the exact filter, without its linearisation.
#[test]
fn ensembles_on_the_workload() {
    let Some(reference) = reference() else { return };
    let groups = groups(Basis::Legendre { count: 8 });
    let model = Model::train(&training_set(&reference), &TrainingConfig::new(groups)).unwrap();
    let exact = palm_errors_mm(|_| Filter::new(&model, &FilterConfig::default()).unwrap());
    for members in [100, 300] {
        let errors = palm_errors_mm(|seed| {
            let config = EnsembleConfig {
                members,
                seed,
                ..EnsembleConfig::default()
            };
            EnsembleFilter::new(&model, &config).unwrap()
        });
        for (got, exact) in errors.iter().zip(exact) {
            assert!(*got < 1.3 * exact, "{members}: {errors:?}");
        }
    }
}
