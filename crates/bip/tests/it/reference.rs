//! Agreement with the published implementation and with an independent exact filter.

use crate::common::{
    HAND, cases, csv, excerpt, floats, groups, json, moments, reference, step, training_set,
};
use hwall_bip::{Filter, FilterConfig, Model, NoiseSource, TrainingConfig};
use hwall_testkit::ErrorStats;
use serde_json::Value;

const ARM: [usize; 7] = [18, 19, 20, 21, 22, 23, 24];

fn config() -> FilterConfig {
    FilterConfig {
        acceleration_variance: Some(1e-8),
        noise: NoiseSource::Fit,
        ..FilterConfig::default()
    }
}

const FIELDS: [&str; 6] = ["phase", "velocity", "covariance", "palm", "arm", "arm sd"];

/// Differences from recorded test runs, by field.
#[derive(Default)]
struct Differences(Vec<(&'static str, f64)>);

impl Differences {
    fn add(&mut self, field: &'static str, got: f64, want: f64) {
        self.0.push((field, got - want));
    }

    fn check(&self, name: &str, tolerance: [f64; 6]) {
        for (field, tolerance) in FIELDS.into_iter().zip(tolerance) {
            let own = self.0.iter().filter(|(of, _)| *of == field);
            let stats: ErrorStats = own.map(|(_, difference)| *difference).collect();
            println!("{name} {field}: {stats}");
            assert!(stats.max <= tolerance, "{name} {field}: {stats}");
        }
    }
}

fn run_exact(model: &Model, samples: &[Vec<f64>], expected: &Value, out: &mut Differences) {
    let mut filter = Filter::new(model, &config()).unwrap();
    for (k, sample) in samples.iter().enumerate() {
        step(&mut filter, &HAND, &sample[..18]);
        let at = |key: &str| expected[key][k].as_f64().unwrap();
        out.add("phase", filter.phase(), at("phase"));
        out.add("velocity", filter.phase_velocity(), at("phase_vel"));
        // Relative to the size of the entries, which span two decades.
        let [[p00, p01], [_, p11]] = filter.phase_covariance();
        let scale = (at("P00") * at("P11")).sqrt();
        out.add("covariance", p00 / at("P00"), 1.0);
        out.add("covariance", p01 / scale, at("P01") / scale);
        out.add("covariance", p11 / at("P11"), 1.0);
        let [mean, variance] = moments(&mut filter, 1.0, ARM);
        let [q, sd] = ["q_final", "q_final_sd"].map(|key| floats(&expected[key][k]));
        for j in 0..7 {
            out.add("arm", mean[j], q[j]);
            out.add("arm sd", variance[j].sqrt(), sd[j]);
        }
        let (mut palm, mut covariance) = ([0.0; 3], [0.0; 9]);
        filter
            .covariance_at(1.0, &[0, 1, 2], &mut palm, &mut covariance)
            .unwrap();
        for (got, want) in palm.into_iter().zip(floats(&expected["palm_final"][k])) {
            out.add("palm", got, want);
        }
    }
}

#[test]
fn low_rank_filter_agrees_with_the_excerpt() {
    let (prior, tests) = excerpt();
    let model = Model::from_prior(&prior).unwrap();
    let mut out = Differences::default();
    for test in tests.as_array().unwrap() {
        let samples = test["samples"].as_array().unwrap();
        let samples: Vec<Vec<f64>> = samples.iter().map(floats).collect();
        run_exact(&model, &samples, &test["exact"], &mut out);
    }
    // The phase depends on the rounded weights with a gain below 100.
    out.check("excerpt", [1e-9, 1e-9, 1e-6, 1e-8, 1e-8, 1e-8]);
}

/// Every step of every test run of the three cases: 30 runs, 3,211 steps each.
#[test]
fn low_rank_filter_agrees_with_the_exact_reference() {
    let Some(reference) = reference() else { return };
    let demonstrations = training_set(&reference);
    for (case, basis) in cases() {
        let config = TrainingConfig::published(groups(basis));
        let model = Model::train(&demonstrations, &config).unwrap();
        assert_eq!(model.rank(), 46);
        let mut out = Differences::default();
        let runs = json(&reference.join(case).join("ekf_exact.json"));
        for run in runs["tests"].as_array().unwrap() {
            let id = run["id"].as_u64().unwrap();
            let samples = csv(&reference.join(format!("workload/test_{id:03}.csv")));
            run_exact(&model, &samples, run, &mut out);
        }
        out.check(case, [1e-8, 1e-8, 1e-6, 1e-6, 1e-6, 1e-6]);
    }
}

#[test]
fn training_agrees_with_the_published_prior() {
    let Some(reference) = reference() else { return };
    let demonstrations = training_set(&reference);
    for (case, basis) in cases() {
        let model =
            Model::train(&demonstrations, &TrainingConfig::published(groups(basis))).unwrap();
        let prior = model.to_prior();
        let expected = json(&reference.join(case).join("prior.json"));
        for (got, want) in prior.mean.iter().zip(floats(&expected["mean_w"])) {
            assert!((got - want).abs() < 1e-11, "{case}: mean {got} {want}");
        }
        let covariance = expected["cov_w"].as_array().unwrap();
        let largest = expected["cov_sv_max"].as_f64().unwrap();
        let n = prior.mean.len();
        for (i, row) in covariance.iter().enumerate() {
            for (j, want) in floats(row).into_iter().enumerate() {
                let got: f64 = (0..prior.rank)
                    .map(|c| prior.factor[i * prior.rank + c] * prior.factor[j * prior.rank + c])
                    .sum();
                let off = got - want;
                assert!(off.abs() < 1e-11 * largest, "{case}: ({i}, {j}) of {n}");
            }
        }
        let noise = floats(&expected["obs_noise_mse_diag"]);
        for (got, want) in model.noise_fit().iter().zip(noise) {
            let off = got / want - 1.0;
            assert!(off.abs() < 1e-9, "{case}: noise {got} {want}");
        }
        let velocity = model.phase_velocity();
        let want = floats(&expected["initial_phase_mean"])[1];
        assert!((velocity.mean / want - 1.0).abs() < 1e-12);
        let want = floats(&expected["initial_phase_var"])[1];
        assert!((velocity.variance / want - 1.0).abs() < 1e-12);
    }
}
