//! Persistent deviations: the Markov process in addition to the motion.

use crate::common::{moments, one_group};
use hwall_bip::{
    Basis, Demonstration, EnsembleConfig, EnsembleFilter, Filter, FilterConfig, Group, Model,
    NoiseSource, Observation, PhaseVelocity, Prior, Tuned, TuningConfig, tune,
};
use hwall_testkit::Sampler;

/// One value, one direction `0.5 + 0.8 x + 0.3 x²`, `x = 2 phase - 1`; the phase is known.
fn model() -> Model {
    Model::from_prior(&Prior {
        groups: vec![Group::observed("a", 1, Basis::Polynomial { count: 3 })],
        mean: vec![1.0, 0.5, -0.2],
        factor: vec![0.5, 0.8, 0.3],
        rank: 1,
        offset: vec![0.25],
        noise: vec![1e-8],
        phase_velocity: PhaseVelocity {
            mean: 0.02,
            variance: 1e-24,
        },
        sampling_period: 1.0,
    })
    .unwrap()
}

fn filter(correlation_time: f64) -> Filter {
    let config = FilterConfig {
        phase_variance: 1e-24,
        acceleration_variance: Some(0.0),
        noise: NoiseSource::Fit,
        noise_factor: Some(1e6), // 0.1 standard deviation, nearly all of it persistent
        correlation_time: Some(correlation_time),
        ..FilterConfig::default()
    };
    Filter::new(&model(), &config).unwrap()
}

fn mean_and_row(phase: f64) -> [f64; 2] {
    let x = 2.0 * phase - 1.0;
    [
        0.25 + 1.0 + 0.5 * x - 0.2 * x * x,
        0.5 + 0.8 * x + 0.3 * x * x,
    ]
}

/// Solves a symmetric positive definite system by elimination; also the logarithm of the determinant.
fn solve(n: usize, matrix: &[f64], b: &[f64]) -> (Vec<f64>, f64) {
    let (mut a, mut b) = (matrix.to_vec(), b.to_vec());
    let mut log_det = 0.0;
    for k in 0..n {
        log_det += a[k * n + k].ln();
        for i in k + 1..n {
            let f = a[i * n + k] / a[k * n + k];
            for j in k..n {
                a[i * n + j] -= f * a[k * n + j];
            }
            b[i] -= f * b[k];
        }
    }
    for k in (0..n).rev() {
        let later: f64 = (k + 1..n).map(|j| a[k * n + j] * b[j]).sum();
        b[k] = (b[k] - later) / a[k * n + k];
    }
    (b, log_det)
}

/// Differences from the last measurement give the same posterior and likelihood as all measurements together with the covariance of the process.
#[test]
fn differences_are_generalised_least_squares() {
    let correlation_time = 7.0;
    let mut filter = filter(correlation_time);
    let mut sampler = Sampler::new(51);
    let (mut times, mut ys, mut now) = (Vec::new(), Vec::new(), 0.0);
    let mut log_likelihood = 0.0;
    for k in 0..20 {
        // Irregular steps with gaps.
        let dt = 0.5 + sampler.uniform(0.0, 2.0);
        now += dt;
        filter.predict(dt).unwrap();
        if k % 5 == 3 {
            continue;
        }
        let [mean, row] = mean_and_row(0.02 * now);
        let y = mean + 0.7 * row + 0.1 * sampler.normal();
        let update = filter.observe(&Observation::new(&[0], &[y])).unwrap();
        log_likelihood += update.log_likelihood;
        times.push(now);
        ys.push(y);
    }
    let n = times.len();
    let sigma: Vec<f64> = (0..n * n)
        .map(|at| {
            let apart: f64 = times[at / n] - times[at % n];
            0.01 * (-apart.abs() / correlation_time).exp()
        })
        .collect();
    let rows: Vec<f64> = times.iter().map(|t| mean_and_row(0.02 * t)[1]).collect();
    let away: Vec<f64> = times
        .iter()
        .zip(&ys)
        .map(|(t, y)| y - mean_and_row(0.02 * t)[0])
        .collect();
    let (weighted, _) = solve(n, &sigma, &rows);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let precision = 1.0 + dot(&weighted, &rows);
    let c = dot(&weighted, &away) / precision;
    let (got, variance) = (
        filter.coefficients().next().unwrap(),
        filter.covariance()[8],
    );
    // The filter chooses the sign of the factor.
    assert!((got.abs() - c.abs()).abs() < 1e-5, "{got} {c}");
    assert!((variance * precision - 1.0).abs() < 1e-5);
    // ln N(away; 0, Σ + row rowᵀ), by the determinant lemma and elimination.
    let mut total = sigma;
    for i in 0..n {
        for j in 0..n {
            total[i * n + j] += rows[i] * rows[j];
        }
    }
    let (solved, log_det) = solve(n, &total, &away);
    let quadratic = dot(&away, &solved);
    let expected = -0.5 * (quadratic + log_det + n as f64 * std::f64::consts::TAU.ln());
    let off = log_likelihood - expected;
    assert!(off.abs() < 1e-3, "{log_likelihood} {expected}");
}

#[test]
fn a_deviation_lasts_and_is_forgotten() {
    let mut filter = filter(5.0);
    for _ in 0..10 {
        filter.predict(1.0).unwrap();
        let [mean, _] = mean_and_row(filter.phase());
        filter
            .observe(&Observation::new(&[0], &[mean + 0.1]))
            .unwrap();
    }
    let at = |filter: &mut Filter, phase: f64| {
        let (mut m, mut v) = ([0.0], [0.0]);
        filter.predict_at(phase, &[0], &mut m, &mut v).unwrap();
        let [[plain], _] = moments(filter, phase, [0]);
        (m[0], v[0], plain)
    };
    let now = filter.phase();
    let (m, v, _) = at(&mut filter, now);
    let [mean, _] = mean_and_row(now);
    assert!((m - mean - 0.1).abs() < 1e-5 && v.sqrt() < 1e-3, "{m} {v}");
    let (m, v, plain) = at(&mut filter, 1.0); // 40 later, eight correlation times
    assert!((m - plain).abs() < 1e-3);
    assert!(v.sqrt() > 0.09);
    // In between, the prediction becomes less and less certain.
    let sds = [0.25, 0.3, 0.5].map(|phase| at(&mut filter, phase).1);
    assert!(sds[0] < sds[1] && sds[1] < sds[2]);
}

/// Wandering motions: tuning finds that deviations persist, and predicts the end better.
#[test]
fn tuning_finds_deviations_that_last() {
    let mut sampler = Sampler::new(52);
    let demonstrations: Vec<Demonstration> = (0..20)
        .map(|_| {
            let goal = sampler.uniform(0.4, 0.8);
            let mut own = 0.01 * sampler.normal();
            let mut values = Vec::new();
            for k in 0..60 {
                let t = f64::from(k) / 59.0;
                let a = (-1.0_f64 / 15.0).exp();
                own = a * own + 0.01 * (1.0 - a * a).sqrt() * sampler.normal();
                values.push(goal * t * t * (3.0 - 2.0 * t) + 0.3 * t + own);
            }
            Demonstration::from_samples(0.02, 1, values).unwrap()
        })
        .collect();
    let training = one_group(1, Basis::Legendre { count: 4 });
    let config = TuningConfig::new(&training);
    let lasting = tune(&demonstrations, &training, &config).unwrap().model;
    let independent = TuningConfig {
        correlation_times: vec![0.0],
        ..config
    };
    let Tuned {
        model: plain,
        trials,
    } = tune(&demonstrations, &training, &independent).unwrap();
    let found = lasting.tuning().unwrap();
    assert!(found.correlation_time >= 0.05, "{found:?}");
    assert!(trials.iter().all(|t| t.tuning.correlation_time == 0.0));
    let config = EnsembleConfig::default();
    assert!(EnsembleFilter::new(&plain, &config).is_ok());
    assert!(EnsembleFilter::new(&lasting, &config).is_err());
}
