//! Agreement with an independent filter on the excerpt in `tests/data`, offline. The other filter in the excerpt is for `hwall-lab`, with the
//! published convention.

use crate::common::{HAND, floats, groups, json, moments, step};
use hwall_bip::{Basis, Filter, FilterConfig, Model, NoiseSource, PhaseVelocity, Prior};
use serde_json::Value;
use std::path::Path;

/// The excerpt is rounded to 13 digits; the phase depends on its weights with a gain below 100.
const PHASE: f64 = 1e-9;
const PLACE: f64 = 1e-8;

fn excerpt() -> (Prior, Value) {
    let data = json(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/poly_b4.json"));
    let number = |key: &str| data[key].as_f64().unwrap();
    let prior = Prior {
        offset: vec![0.0; 25],
        groups: groups(Basis::Polynomial { count: 4 }),
        mean: floats(&data["mean"]),
        factor: floats(&data["factor"]),
        rank: data["rank"].as_u64().unwrap() as usize,
        noise: floats(&data["noise"]),
        phase_velocity: PhaseVelocity {
            mean: number("velocity_mean"),
            variance: number("velocity_variance"),
        },
        sampling_period: 1.0,
    };
    (prior, data["tests"].clone())
}

fn close(what: &str, k: usize, got: f64, want: f64, tolerance: f64) {
    assert!(
        (got - want).abs() <= tolerance,
        "{what}, step {k}: {got} instead of {want}"
    );
}

#[test]
fn low_rank_filter_agrees_with_the_exact_one() {
    let (prior, tests) = excerpt();
    let model = Model::from_prior(&prior).unwrap();
    let config = FilterConfig {
        acceleration_variance: Some(1e-8),
        noise: NoiseSource::Fit,
        ..FilterConfig::default()
    };
    for test in tests.as_array().unwrap() {
        let want = &test["exact"];
        let mut filter = Filter::new(&model, &config).unwrap();
        for (k, sample) in test["samples"].as_array().unwrap().iter().enumerate() {
            let at = |key: &str| want[key][k].as_f64().unwrap();
            step(&mut filter, &HAND, &floats(sample));
            close("phase", k, filter.phase(), at("phase"), PHASE);
            let velocity = filter.phase_velocity();
            close("velocity", k, velocity, at("phase_vel"), PHASE);
            let p = filter.phase_covariance();
            close("P00", k, p[0][0], at("P00"), 1e-6 * at("P00"));
            close("P11", k, p[1][1], at("P11"), 1e-6 * at("P11"));
            let dofs = [0, 1, 2, 18, 19, 20, 21, 22, 23, 24];
            let [mean, variance] = moments(&mut filter, 1.0, dofs);
            let palm = floats(&want["palm_final"][k]);
            let arm = floats(&want["q_final"][k]);
            let sd = floats(&want["q_final_sd"][k]);
            for (got, want) in mean.iter().zip(palm.iter().chain(&arm)) {
                close("place at the end", k, *got, *want, PLACE);
            }
            for (got, want) in variance[3..].iter().zip(&sd) {
                close("deviation at the end", k, got.sqrt(), *want, PLACE);
            }
        }
    }
}
