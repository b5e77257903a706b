//! Identities that hold for any data.

use crate::common::{cubics, evaluate, trained};
use hwall_bip::{Basis, Filter, FilterConfig, Group, Model, Observation, TrainingConfig};
use hwall_testkit::central_difference;

fn all_bases() -> Vec<Basis> {
    vec![
        Basis::gaussian(1),
        Basis::gaussian(6),
        Basis::Gaussian {
            count: 12,
            variance: 0.07,
        },
        Basis::normalized_gaussian(8),
        Basis::NormalizedGaussian {
            count: 5,
            variance: 1e-3,
        },
        Basis::Sigmoid {
            count: 6,
            width: 0.02,
        },
        Basis::Polynomial { count: 8 },
        Basis::Legendre { count: 8 },
        Basis::Chebyshev { count: 8 },
    ]
}

#[test]
fn derivatives_are_central_differences() {
    for basis in all_bases() {
        for i in 0..=60 {
            let phase = -1.0 + i as f64 * 0.05;
            let (_, slopes) = evaluate(basis, phase);
            let largest = slopes.iter().fold(1.0, |m: f64, s| m.max(s.abs()));
            for (b, slope) in slopes.iter().enumerate() {
                let numeric = central_difference(|x| evaluate(basis, x).0[b], phase, 1e-6);
                assert!(
                    (numeric - slope).abs() < 1e-6 * largest,
                    "{basis:?} function {b} at {phase}: {slope} against {numeric}"
                );
            }
        }
    }
}

#[test]
fn normalized_gaussians_add_up_to_one_everywhere() {
    for phase in [-1e9, -40.0, -0.3, 0.0, 0.5, 1.0, 7.0, 1e9] {
        let (values, slopes) = evaluate(Basis::normalized_gaussian(7), phase);
        assert!((values.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        assert!(slopes.iter().sum::<f64>().abs() < 1e-12);
    }
}

#[test]
fn training_recovers_planted_cubics() {
    // Cubics lie in the span of all polynomials from degree 3 on: the fit is exact.
    for basis in [
        Basis::Polynomial { count: 4 },
        Basis::Legendre { count: 7 },
        Basis::Chebyshev { count: 5 },
    ] {
        let demonstrations = cubics(1, 6, 3, 0.0);
        let model = trained(&demonstrations, basis);
        assert_eq!(model.rank(), 5);
        for phase in [0.0, 0.31, 0.5, 1.0] {
            let mut mean = [0.0; 3];
            model.mean_at(phase, &mut mean).unwrap();
            for (d, mean) in mean.iter().enumerate() {
                let truth: f64 = demonstrations
                    .iter()
                    .map(|m| {
                        // Lagrange interpolation through four samples gives the true cubic at any phase.
                        let at = [0, 13, 26, m.len() - 1];
                        at.iter()
                            .map(|&i| {
                                let weight: f64 = at
                                    .iter()
                                    .filter(|j| **j != i)
                                    .map(|&j| (phase - m.phase(j)) / (m.phase(i) - m.phase(j)))
                                    .product();
                                weight * m.sample(i)[d]
                            })
                            .sum::<f64>()
                    })
                    .sum::<f64>()
                    / 6.0;
                assert!((mean - truth).abs() < 1e-11, "{basis:?}: {mean} {truth}");
            }
        }
    }
}

#[test]
fn prior_survives_the_round_trip_through_named_weights() {
    let demonstrations = cubics(6, 5, 2, 0.01);
    let groups = vec![
        Group::observed("a", 1, Basis::Polynomial { count: 6 }),
        Group::controlled("b", 1, Basis::gaussian(4)),
    ];
    let config = TrainingConfig {
        centre: false,
        ..TrainingConfig::new(groups)
    };
    let model = Model::train(&demonstrations, &config).unwrap();
    let again = Model::from_prior(&model.to_prior()).unwrap();
    for phase in [0.0, 0.2, 0.9] {
        let (mut a, mut b) = ([0.0; 2], [0.0; 2]);
        model.mean_at(phase, &mut a).unwrap();
        again.mean_at(phase, &mut b).unwrap();
        assert!((a[0] - b[0]).abs().max((a[1] - b[1]).abs()) < 1e-12);
    }
}

fn small_filter() -> Filter {
    let model = trained(&cubics(7, 6, 3, 0.01), Basis::Legendre { count: 5 });
    let mut filter = Filter::new(&model, &FilterConfig::default()).unwrap();
    filter.predict(20.0).unwrap();
    filter
}

/// Checks the covariance by its definition: evidence with unit gain on a linear row.
#[test]
fn evidence_at_a_phase_is_the_textbook_update() {
    let mut filter = small_filter();
    let dofs = [0, 2];
    let (mut mean, mut p) = ([0.0; 2], [0.0; 4]);
    filter.covariance_at(0.8, &dofs, &mut mean, &mut p).unwrap();
    let r = [0.02, 0.007, 0.007, 0.01];
    let y = [mean[0] + 0.1, mean[1] - 0.05];
    let s = [p[0] + r[0], p[1] + r[1], p[2] + r[2], p[3] + r[3]];
    let det = s[0] * s[3] - s[1] * s[2];
    let inverse = [s[3] / det, -s[1] / det, -s[2] / det, s[0] / det];
    let e = [0.1, -0.05];
    let v = [
        inverse[0] * e[0] + inverse[1] * e[1],
        inverse[2] * e[0] + inverse[3] * e[1],
    ];
    let expected = [
        mean[0] + p[0] * v[0] + p[1] * v[1],
        mean[1] + p[2] * v[0] + p[3] * v[1],
    ];
    let distance = e[0] * v[0] + e[1] * v[1];
    let likelihood = -0.5 * (distance + det.ln()) - std::f64::consts::TAU.ln();
    let phase = (filter.phase(), filter.phase_covariance());
    let update = filter
        .observe_at(0.8, &Observation::new(&dofs, &y).with_covariance(&r))
        .unwrap();
    filter.covariance_at(0.8, &dofs, &mut mean, &mut p).unwrap();
    for (got, want) in mean.iter().zip(expected) {
        assert!((got - want).abs() < 1e-12);
    }
    assert!((update.distance_squared - distance).abs() < 1e-11);
    assert!((update.log_likelihood - likelihood).abs() < 1e-11);
    // Evidence about the shape does not change the phase before the two are correlated.
    let after = filter.phase_covariance();
    assert!((phase.0 - filter.phase()).abs() < 1e-14);
    assert!((phase.1[0][0] / after[0][0] - 1.0).abs() < 1e-12);
}

#[test]
fn variances_are_a_diagonal_covariance_in_any_order() {
    let (mut a, mut b) = (small_filter(), small_filter());
    let variances = Observation::new(&[0, 1, 2], &[0.4, 1.3, 2.5]);
    let first = a
        .observe(&variances.with_variances(&[0.01, 0.02, 0.03]))
        .unwrap();
    let r = [0.03, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.02];
    let full = Observation::new(&[2, 0, 1], &[2.5, 0.4, 1.3]);
    let second = b.observe(&full.with_covariance(&r)).unwrap();
    assert!((first.log_likelihood - second.log_likelihood).abs() < 1e-9);
    assert!((a.phase() - b.phase()).abs() < 1e-13);
    for (x, y) in a.covariance().iter().zip(b.covariance()) {
        assert!((x - y).abs() < 1e-13);
    }
}

#[test]
fn evidence_on_the_phase_is_the_scalar_update() {
    let mut filter = small_filter();
    let (phase, p) = (filter.phase(), filter.phase_covariance());
    let update = filter.observe_phase(0.5, 1e-3).unwrap();
    let gain = p[0][0] / (p[0][0] + 1e-3);
    let expected = phase + gain * (0.5 - phase);
    assert!((filter.phase() - expected).abs() < 1e-13);
    let after = filter.phase_covariance();
    assert!((after[0][0] - (1.0 - gain) * p[0][0]).abs() < 1e-13);
    assert!((after[1][1] - (p[1][1] - p[0][1].powi(2) / (p[0][0] + 1e-3))).abs() < 1e-13);
    assert_eq!(update.rows, 1);
}

#[test]
fn prediction_is_the_textbook_one() {
    let mut filter = small_filter();
    filter
        .observe(&Observation::new(&[0, 1], &[0.3, 1.4]))
        .unwrap();
    let n = (filter.covariance().len() as f64).sqrt() as usize;
    let before = filter.covariance();
    let (phase, velocity) = (filter.phase(), filter.phase_velocity());
    let dt: f64 = 0.7;
    filter.predict(dt).unwrap();
    assert!((filter.phase() - (phase + dt * velocity)).abs() < 1e-15);
    let after = filter.covariance();
    // F P Fᵀ + Q by rows, then by columns.
    let mut expected = before;
    for j in 0..n {
        expected[j] += dt * expected[n + j];
    }
    for i in 0..n {
        expected[i * n] += dt * expected[i * n + 1];
    }
    let model_q = (0.01 * prior_velocity()).powi(2);
    expected[0] += model_q * dt.powi(4) / 4.0;
    expected[1] += model_q * dt.powi(3) / 2.0;
    expected[n] += model_q * dt.powi(3) / 2.0;
    expected[n + 1] += model_q * dt * dt;
    for (a, b) in after.iter().zip(&expected) {
        assert!((a - b).abs() < 1e-13, "{a} {b}");
    }
}

/// Mean phase velocity of the motions of [`small_filter`].
fn prior_velocity() -> f64 {
    let rates: Vec<f64> = cubics(7, 6, 3, 0.01)
        .iter()
        .map(|m| 1.0 / m.duration())
        .collect();
    rates.iter().sum::<f64>() / 6.0
}
