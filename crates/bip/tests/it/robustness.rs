//! Outliers, and the filter's own health statistics.

use crate::common::{moments, step, trained};
use hwall_bip::{
    ArgumentError, Basis, BipError, Demonstration, Filter, FilterConfig, Gate, Model, Observation,
};
use hwall_testkit::{Sampler, minimum_jerk};

const DOFS: usize = 6;
const ALL: [usize; DOFS] = [0, 1, 2, 3, 4, 5];

fn motion(sampler: &mut Sampler) -> Demonstration {
    let samples = 60 + sampler.index(40);
    let goal: Vec<f64> = (0..DOFS).map(|_| sampler.uniform(0.2, 0.7)).collect();
    let mut values = Vec::new();
    for k in 0..samples {
        let t = k as f64 / (samples - 1) as f64;
        let r = minimum_jerk(t);
        values.extend(
            goal.iter()
                .map(|g| g * r + 0.2 * t + 1.5e-3 * sampler.normal()),
        );
    }
    Demonstration::from_samples(1.0, DOFS, values).unwrap()
}

fn model() -> Model {
    let mut sampler = Sampler::new(11);
    let demonstrations: Vec<_> = (0..15).map(|_| motion(&mut sampler)).collect();
    trained(&demonstrations, Basis::Legendre { count: 8 })
}

fn gated(model: &Model, gate: Option<Gate>) -> Filter {
    let config = FilterConfig {
        gate,
        noise_factor: Some(4.0),
        ..FilterConfig::default()
    };
    Filter::new(model, &config).unwrap()
}

fn gate(deviations: f64, patience: usize) -> Gate {
    Gate {
        deviations,
        patience,
    }
}

fn end(filter: &mut Filter) -> [f64; DOFS] {
    moments(filter, 1.0, ALL)[0]
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .fold(0.0, |m, (a, b)| f64::max(m, (a - b).abs()))
}

#[test]
fn a_finger_that_jumps_is_refused_alone() {
    let model = model();
    let mut sampler = Sampler::new(12);
    let seen = motion(&mut sampler);
    let (mut open, mut safe) = (gated(&model, None), gated(&model, Some(Gate::default())));
    for k in 0..seen.len() {
        let mut y = seen.sample(k).to_vec();
        // The tracker sometimes swaps fingers, an error of half a metre.
        if k % 7 == 3 {
            y[k % DOFS] += 0.5;
        }
        for filter in [&mut open, &mut safe] {
            filter.predict(1.0).unwrap();
            let update = filter.observe(&Observation::new(&ALL, &y)).unwrap();
            assert_eq!(update.rows + update.gated, DOFS);
            assert!(update.log_likelihood.is_finite());
        }
    }
    let truth = seen.sample(seen.len() - 1);
    assert!(worst(&end(&mut safe), truth) < 0.01);
    assert!(worst(&end(&mut open), truth) > 0.02);
    let health = safe.health();
    let jumps = (0..seen.len()).filter(|k| k % 7 == 3).count() as u64;
    assert!((jumps..=jumps + 3).contains(&health.gated), "{health:?}");
    assert_eq!(open.health().gated, 0);
}

#[test]
fn refusing_is_not_listing() {
    let model = model();
    let mut sampler = Sampler::new(13);
    let seen = motion(&mut sampler);
    let correlated = |n: usize| -> Vec<f64> {
        let entries = (0..n * n).map(|at| if at % (n + 1) == 0 { 4e-4 } else { 1e-4 });
        entries.collect()
    };
    let (covariance, part) = (correlated(DOFS), correlated(DOFS - 1));
    let mut gate = gated(&model, Some(Gate::default()));
    let mut less = gated(&model, None);
    for k in 0..20 {
        let mut y = seen.sample(k).to_vec();
        y[2] = -9.0;
        let kept = [y[0], y[1], y[3], y[4], y[5]];
        gate.predict(1.0).unwrap();
        less.predict(1.0).unwrap();
        gate.observe(&Observation::new(&ALL, &y).with_covariance(&covariance))
            .unwrap();
        less.observe(&Observation::new(&[0, 1, 3, 4, 5], &kept).with_covariance(&part))
            .unwrap();
        assert_eq!(gate.phase(), less.phase());
    }
    assert_eq!(gate.covariance(), less.covariance());
}

/// The values are within the noise alone, so that no variance is computed, or only within the variance of their prediction.
#[test]
fn a_gate_that_refuses_nothing_changes_no_bit() {
    let model = model();
    let mut sampler = Sampler::new(15);
    let (mut within_noise, mut beyond) = (0, 0);
    for lasting in [0.0, 3.0] {
        let filter = |gate| {
            let config = FilterConfig {
                gate,
                correlation_time: Some(lasting),
                phase: 0.4,
                phase_variance: 0.01,
                noise_factor: Some(4.0),
                ..FilterConfig::default()
            };
            Filter::new(&model, &config).unwrap()
        };
        for _ in 0..40 {
            let seen = motion(&mut sampler);
            let (mut gate, mut open) = (filter(Some(gate(12.0, 5))), filter(None));
            for k in 30..45 {
                gate.predict(1.0).unwrap();
                open.predict(1.0).unwrap();
                let phase = open.phase();
                let [mean, _] = moments(&mut open, phase, ALL);
                let sure = ALL.iter().all(|&d| {
                    let noise = open.noise_variance(d).unwrap();
                    (seen.sample(k)[d] - mean[d]).powi(2) <= 144.0 * noise
                });
                within_noise += usize::from(sure);
                beyond += usize::from(!sure);
                let observation = Observation::new(&ALL, seen.sample(k));
                let (a, b) = (gate.observe(&observation), open.observe(&observation));
                assert_eq!(a.unwrap(), b.unwrap(), "{lasting}, {k}");
            }
            assert_eq!(gate.covariance(), open.covariance());
            assert!(gate.coefficients().eq(open.coefficients()));
        }
    }
    assert!(within_noise > 600 && beyond > 5, "{within_noise}, {beyond}");
}

#[test]
fn a_filter_that_refuses_everything_listens_again() {
    let model = model();
    let mut sampler = Sampler::new(14);
    let (first, second) = (motion(&mut sampler), motion(&mut sampler));
    let mut filter = gated(&model, Some(gate(4.0, 3)));
    for k in 0..30 {
        step(&mut filter, &ALL, first.sample(k));
    }
    // The values are those of another hand, somewhere else: the estimate is wrong, not the tracker.
    let mut refused = 0;
    for k in 30..second.len() {
        let y: Vec<f64> = second.sample(k).iter().map(|y| y + 0.3).collect();
        filter.predict(1.0).unwrap();
        refused += filter.observe(&Observation::new(&ALL, &y)).unwrap().gated;
    }
    assert!(refused > 0);
    assert!(filter.health().rows > 30 * DOFS as u64 + 20);
    let config = FilterConfig {
        gate: Some(gate(0.0, 1)),
        ..FilterConfig::default()
    };
    assert!(matches!(
        Filter::new(&model, &config),
        Err(BipError::Argument(ArgumentError::OutOfRange { .. }))
    ));
}

#[test]
fn health_adds_up() {
    let model = model();
    let mut sampler = Sampler::new(15);
    let seen = motion(&mut sampler);
    let mut filter = gated(&model, None);
    let mut sum = 0.0;
    for k in 0..seen.len() {
        filter.predict(1.0).unwrap();
        let observation = Observation::new(&ALL, seen.sample(k));
        sum += filter.observe(&observation).unwrap().log_likelihood;
    }
    let health = filter.health();
    assert_eq!(health.updates, seen.len() as u64);
    assert_eq!(health.rows, (seen.len() * DOFS) as u64);
    assert!((health.log_likelihood - sum).abs() < 1e-9);
    assert!(health.condition >= 1.0 && health.condition.is_finite());
    // Noise variance four times too large: distances are a quarter of the expected ones.
    assert!(health.recent_distance > 0.05 && health.recent_distance < 1.0);
    for _ in 0..30 {
        filter.observe(&Observation::new(&[0], &[5.0])).unwrap();
    }
    let health = filter.health();
    assert!(health.recent_distance > 2.0, "{health:?}");
}

#[test]
fn evidence_more_precise_than_any_sensor_is_still_taken() {
    let model = model();
    for variance in [1e-30, 1e-190, 1e-206, 1e-250] {
        let mut filter = gated(&model, None);
        filter.observe_phase(0.4, variance).unwrap();
        let off = filter.phase() - 0.4;
        assert!(off.abs() < 1e-12, "variance {variance:e}");
        let seen = Observation::new(&[0], &[0.5]);
        filter
            .observe_at(1.0, &seen.with_variances(&[variance]))
            .unwrap();
        let off = end(&mut filter)[0] - 0.5;
        assert!(off.abs() < 1e-9, "variance {variance:e}");
    }
}

#[test]
fn steps_that_overflow_leave_the_belief() {
    let model = model();
    let config = FilterConfig {
        phase_variance: 1e-20,
        ..FilterConfig::default()
    };
    let mut filter = Filter::new(&model, &config).unwrap();
    let before = filter.covariance();
    for dt in [1e152, 1e200, 1e308] {
        if filter.predict(dt).is_ok() {
            assert!(filter.covariance().iter().all(|p| p.is_finite()), "{dt:e}");
            filter = Filter::new(&model, &config).unwrap();
        } else {
            assert_eq!(before, filter.covariance());
        }
    }
}

/// A failed observation does not count as a rejected one.
#[test]
fn an_error_leaves_the_patience_of_the_gate() {
    let model = model();
    let mut filter = gated(&model, Some(gate(4.0, 1)));
    step(&mut filter, &ALL, &[0.0; DOFS]);
    for _ in 0..3 {
        let huge = Observation::new(&ALL, &[1e308; DOFS]);
        assert!(filter.observe(&huge).is_err());
    }
    let far = Observation::new(&ALL, &[9.0; DOFS]);
    assert_eq!(filter.observe(&far).unwrap().gated, DOFS);
}
