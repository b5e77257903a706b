//! The published filter against the published implementation and against the exact filter.

use crate::bip::{HAND, cases, csv, cubics, excerpt, groups, json, reference, training_set};
use hwall_bip::{
    Basis, Filter, FilterConfig, Group, Model, MotionFilter, NoiseSource, Observation,
    TrainingConfig,
};
use hwall_lab::bip::published_filter::FullFilter;
use serde_json::Value;

/// Numbers of a list; empty if missing.
fn floats(value: &Value) -> Vec<f64> {
    let values = value.as_array().into_iter().flatten();
    values.map(|x| x.as_f64().unwrap()).collect()
}

fn step(filter: &mut FullFilter, dt: f64, dofs: &[usize], values: &[f64]) {
    filter.predict(dt).unwrap();
    filter.observe(&Observation::new(dofs, values)).unwrap();
}

/// Mean and variance of a degree of freedom at the end.
fn end(filter: &mut FullFilter, dof: usize) -> [f64; 2] {
    let (mut mean, mut variance) = ([0.0], [0.0]);
    filter
        .moments_at(1.0, &[dof], &mut mean, &mut variance)
        .unwrap();
    [mean[0], variance[0]]
}

/// Largest differences from recorded runs: of phase, velocity, covariance (relative to the size of its entries, which span two
/// decades), palm and arm.
#[derive(Default)]
struct Differences([f64; 5]);

impl Differences {
    /// Compares one step of a run; skips values missing in the record.
    fn take(&mut self, k: usize, expected: &Value, filter: &mut FullFilter) {
        let at = |key: &str| expected[key][k].as_f64();
        let mut off = |place: usize, got: f64, want: Option<f64>, scale: f64| {
            let off = want.map_or(0.0, |want| (got - want).abs() / scale);
            assert!(!off.is_nan());
            self.0[place] = self.0[place].max(off);
        };
        off(0, filter.phase(), at("phase"), 1.0);
        off(1, filter.phase_velocity(), at("phase_vel"), 1.0);
        if let (Some(p00), Some(p11)) = (at("P00"), at("P11")) {
            let p = filter.phase_covariance();
            off(2, p[0][0], Some(p00), p00);
            off(2, p[0][1], at("P01"), (p00 * p11).sqrt());
            off(2, p[1][1], Some(p11), p11);
        }
        for (place, key, first) in [(3, "palm_final", 0), (4, "q_final", 18)] {
            for (d, want) in floats(&expected[key][k]).into_iter().enumerate() {
                off(place, end(filter, first + d)[0], Some(want), 1.0);
            }
        }
    }

    fn check(&self, name: &str, tolerances: [f64; 5]) {
        let Self(differences) = self;
        println!("{name}: {differences:?}");
        let mut pairs = differences.iter().zip(tolerances);
        let within = pairs.all(|(off, most)| *off <= most);
        assert!(within, "{name}: {differences:?}");
    }
}

#[test]
fn agrees_with_the_published_filter_offline() {
    let (prior, tests) = excerpt();
    for test in tests.as_array().unwrap() {
        let mut filter = FullFilter::new(&prior, 1e-4, 1e-8).unwrap();
        let mut off = Differences::default();
        for (k, sample) in test["samples"].as_array().unwrap().iter().enumerate() {
            step(&mut filter, 1.0, &HAND, &floats(sample));
            off.take(k, &test["published"], &mut filter);
        }
        off.check("offline", [1e-8, 1e-8, 1e-5, 1e-6, 1e-6]);
    }
}

/// On the samples where rounding does not decide.
#[test]
fn agrees_with_all_runs_of_the_published_filter() {
    let Some(reference) = reference() else {
        return;
    };
    let demonstrations = training_set(&reference);
    for (case, basis) in cases() {
        let config = TrainingConfig::published(groups(basis));
        let prior = Model::train(&demonstrations, &config).unwrap().to_prior();
        let runs = json(&reference.join(case).join("ekf_intprim.json"));
        let mut off = Differences::default();
        for run in runs["tests"].as_array().unwrap() {
            let mut filter = FullFilter::new(&prior, 1e-4, 1e-8).unwrap();
            let id = run["id"].as_u64().unwrap();
            let values = csv(&reference.join(format!("workload/test_{id:03}.csv")));
            let sound = run["roundoff_ok_steps"]
                .as_u64()
                .map_or(usize::MAX, |n| n as usize);
            for (k, sample) in values.iter().take(sound).enumerate() {
                step(&mut filter, 1.0, &HAND, &sample[..18]);
                off.take(k, run, &mut filter);
            }
        }
        off.check(case, [1e-7, 1e-6, 1e-5, 1e-7, 5e-6]);
    }
}

/// All columns observed, so that the published convention equals the textbook filter.
#[test]
fn low_rank_filter_equals_full_state() {
    for (seed, basis) in [
        (2, Basis::Polynomial { count: 4 }),
        (3, Basis::Legendre { count: 6 }),
        (4, Basis::normalized_gaussian(5)),
        (5, Basis::gaussian(5)),
    ] {
        let demonstrations = cubics(seed, 9, 4, 0.01);
        let config = TrainingConfig {
            centre: false,
            ..TrainingConfig::new(vec![Group::observed("hand", 4, basis)])
        };
        let model = Model::train(&demonstrations, &config).unwrap();
        let mut low = Filter::new(
            &model,
            &FilterConfig {
                acceleration_variance: Some(1e-8),
                noise: NoiseSource::Fit,
                ..FilterConfig::default()
            },
        )
        .unwrap();
        let mut full = FullFilter::new(&model.to_prior(), 1e-4, 1e-8).unwrap();
        let unseen = &cubics(seed + 100, 1, 4, 0.01)[0];
        for k in 0..unseen.len() {
            let dt = [1.0, 0.4, 1.7][k % 3];
            low.predict(dt).unwrap();
            low.observe(&Observation::new(&[0, 1, 2, 3], unseen.sample(k)))
                .unwrap();
            step(&mut full, dt, &[0, 1, 2, 3], unseen.sample(k));
            assert!((low.phase() - full.phase()).abs() < 1e-8, "{basis:?} {k}");
            let (mut mean, mut variance) = ([0.0; 4], [0.0; 4]);
            low.moments_at(1.0, &[0, 1, 2, 3], &mut mean, &mut variance)
                .unwrap();
            for (d, mean) in mean.iter().enumerate() {
                let [full_mean, full_variance] = end(&mut full, d);
                assert!((mean - full_mean).abs() < 1e-6);
                assert!((variance[d] / full_variance - 1.0).abs() < 1e-6);
            }
        }
    }
}
