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

/// Largest differences from one recorded test run.
#[derive(Debug, Default)]
struct Differences {
    phase: Vec<f64>,
    velocity: Vec<f64>,
    covariance: Vec<f64>,
    palm: Vec<f64>,
    arm: Vec<f64>,
    arm_sd: Vec<f64>,
}

impl Differences {
    fn check(&self, name: &str, tolerance: [f64; 6]) {
        let fields = [
            ("phase", &self.phase),
            ("velocity", &self.velocity),
            ("covariance", &self.covariance),
            ("palm", &self.palm),
            ("arm", &self.arm),
            ("arm sd", &self.arm_sd),
        ];
        for ((field, values), tolerance) in fields.into_iter().zip(tolerance) {
            let stats = ErrorStats::from_errors(values.iter().copied());
            println!("{name} {field}: {stats:?}");
            let worst = values.iter().fold(0.0, |m: f64, v| m.max(*v));
            assert!(worst <= tolerance, "{name} {field}: {worst:e}");
        }
    }

    fn scalars(&mut self, k: usize, expected: &Value, phase: f64, velocity: f64, p: [[f64; 2]; 2]) {
        let at = |key: &str| expected[key][k].as_f64().unwrap();
        self.phase.push((phase - at("phase")).abs());
        self.velocity.push((velocity - at("phase_vel")).abs());
        // Relative to the size of the entries, which span two decades.
        let scale = (at("P00") * at("P11")).sqrt();
        for (got, want, scale) in [
            (p[0][0], at("P00"), at("P00")),
            (p[0][1], at("P01"), scale),
            (p[1][1], at("P11"), at("P11")),
        ] {
            self.covariance.push((got - want).abs() / scale);
        }
    }
}

fn run_exact(model: &Model, samples: &[Vec<f64>], expected: &Value, out: &mut Differences) {
    let mut filter = Filter::new(model, &config()).unwrap();
    for (k, sample) in samples.iter().enumerate() {
        step(&mut filter, &HAND, &sample[..18]);
        let p = filter.phase_covariance();
        out.scalars(k, expected, filter.phase(), filter.phase_velocity(), p);
        let [mean, variance] = moments(&mut filter, 1.0, ARM);
        let [q, sd] = ["q_final", "q_final_sd"].map(|key| floats(&expected[key][k]));
        for j in 0..7 {
            out.arm.push((mean[j] - q[j]).abs());
            out.arm_sd.push((variance[j].sqrt() - sd[j]).abs());
        }
        let (mut palm, mut covariance) = ([0.0; 3], [0.0; 9]);
        filter
            .covariance_at(1.0, &[0, 1, 2], &mut palm, &mut covariance)
            .unwrap();
        for (got, want) in palm.iter().zip(floats(&expected["palm_final"][k])) {
            out.palm.push((got - want).abs());
        }
    }
}

#[test]
fn low_rank_filter_agrees_with_the_excerpt() {
    let (prior, tests) = excerpt();
    let model = Model::from_prior(&prior).unwrap();
    let mut out = Differences::default();
    for test in tests.as_array().unwrap() {
        let samples: Vec<Vec<f64>> = test["samples"]
            .as_array()
            .unwrap()
            .iter()
            .map(floats)
            .collect();
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
        let model =
            Model::train(&demonstrations, &TrainingConfig::published(groups(basis))).unwrap();
        assert_eq!(model.rank(), 46);
        let mut out = Differences::default();
        for run in json(&reference.join(case).join("ekf_exact.json"))["tests"]
            .as_array()
            .unwrap()
        {
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
                assert!(
                    (got - want).abs() < 1e-11 * largest,
                    "{case}: ({i}, {j}) of {n}"
                );
            }
        }
        for (got, want) in model
            .noise_fit()
            .iter()
            .zip(floats(&expected["obs_noise_mse_diag"]))
        {
            assert!(
                (got / want - 1.0).abs() < 1e-9,
                "{case}: noise {got} {want}"
            );
        }
        let velocity = model.phase_velocity();
        let want = floats(&expected["initial_phase_mean"])[1];
        assert!((velocity.mean / want - 1.0).abs() < 1e-12);
        let want = floats(&expected["initial_phase_var"])[1];
        assert!((velocity.variance / want - 1.0).abs() < 1e-12);
    }
}
