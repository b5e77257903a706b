//! The published filter against the published implementation and against the exact filter.

use hwall_bip::{
    Basis, Demonstration, Filter, FilterConfig, Group, Model, NoiseSource, Observation,
    PhaseVelocity, Prior, TrainingConfig,
};
use hwall_lab::bip::published_filter::FullFilter;
use hwall_testkit::{ErrorStats, Sampler, shared};
use serde_json::Value;
use std::path::Path;

/// The hand, in the columns of the workload.
const HAND: [usize; 18] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17];
const DOFS: usize = 25;

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Rows of a CSV file with one header line.
fn csv(path: &Path) -> Vec<Vec<f64>> {
    std::fs::read_to_string(path)
        .unwrap()
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|x| x.parse().unwrap()).collect())
        .collect()
}

/// One demonstration, one sample a unit of time.
fn demonstration(path: &Path) -> Demonstration {
    Demonstration::from_samples(1.0, DOFS, csv(path).concat()).unwrap()
}

fn training_set(reference: &Path) -> Vec<Demonstration> {
    (0..47)
        .map(|i| demonstration(&reference.join(format!("workload/train_{i:03}.csv"))))
        .collect()
}

/// The three cases of the reference.
fn cases() -> [(&'static str, Basis); 3] {
    [
        ("poly_B4", Basis::Polynomial { count: 4 }),
        ("poly_B8", Basis::Polynomial { count: 8 }),
        ("gaussS_B6", Basis::gaussian(6)),
    ]
}

fn groups(basis: Basis) -> Vec<Group> {
    vec![
        Group::observed("hand", 18, basis),
        Group::controlled("arm", 7, basis),
    ]
}

fn floats(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}

/// Largest differences to one recorded test run.
#[derive(Debug, Default)]
struct Differences {
    phase: Vec<f64>,
    velocity: Vec<f64>,
    covariance: Vec<f64>,
    palm: Vec<f64>,
    arm: Vec<f64>,
}

impl Differences {
    fn check(&self, name: &str, tolerance: [f64; 5]) {
        let fields = [
            ("phase", &self.phase),
            ("velocity", &self.velocity),
            ("covariance", &self.covariance),
            ("palm", &self.palm),
            ("arm", &self.arm),
        ];
        for ((field, values), tolerance) in fields.into_iter().zip(tolerance) {
            if values.is_empty() {
                continue;
            }
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

/// The published convention on all weights. Steps up to `roundoff_ok_steps` only,
/// which in these cases are all.
///
/// After a pause that filter throws the phase to and fro by a third a step, which magnifies the
/// rounding of an innovation covariance with entries of 1e-6 and 1e4: less is asked there.
#[test]
fn agrees_with_the_published_filter() {
    let Some(reference) = shared("reference/bip") else {
        return;
    };
    let demonstrations = training_set(&reference);
    for (case, basis) in cases() {
        let prior = Model::train(&demonstrations, &TrainingConfig::published(groups(basis)))
            .unwrap()
            .to_prior();
        let (mut moving, mut paused) = (Differences::default(), Differences::default());
        for run in json(&reference.join(case).join("ekf_intprim.json"))["tests"]
            .as_array()
            .unwrap()
            .iter()
        {
            let out = if run["kind"] == "pause" {
                &mut paused
            } else {
                &mut moving
            };
            let id = run["id"].as_u64().unwrap();
            let steps = run["roundoff_ok_steps"].as_u64().unwrap() as usize;
            let samples = csv(&reference.join(format!("workload/test_{id:03}.csv")));
            let mut filter = FullFilter::new(&prior, 1e-4, 1e-8).unwrap();
            for (k, sample) in samples.iter().take(steps).enumerate() {
                filter.step(1.0, &HAND, &sample[..18]).unwrap();
                let p = filter.phase_covariance();
                out.scalars(k, run, filter.phase(), filter.phase_velocity(), p);
                for (j, want) in floats(&run["q_final"][k]).into_iter().enumerate() {
                    let got = filter.mean_at(1.0, 18 + j).unwrap();
                    out.arm.push((got - want).abs());
                }
                for (d, want) in floats(&run["palm_final"][k]).into_iter().enumerate() {
                    let got = filter.mean_at(1.0, d).unwrap();
                    out.palm.push((got - want).abs());
                }
            }
        }
        // Measured 9.3e-9; the last digits of training depend on the machine.
        moving.check(case, [2e-8, 1e-7, 1e-6, 1e-7, 1e-6]);
        paused.check(&format!("{case}, pause"), [1e-7, 1e-6, 1e-5, 1e-7, 1e-5]);
    }
}

/// The excerpt beside the tests of `hwall-bip`, where its README describes it.
fn excerpt() -> (Prior, Value) {
    let data = json(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../bip/tests/data/poly_b4.json"));
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
fn agrees_with_the_published_filter_offline() {
    let (prior, tests) = excerpt();
    for test in tests.as_array().unwrap() {
        let want = &test["published"];
        let mut filter = FullFilter::new(&prior, 1e-4, 1e-8).unwrap();
        for (k, sample) in test["samples"].as_array().unwrap().iter().enumerate() {
            let at = |key: &str| want[key][k].as_f64().unwrap();
            filter.step(1.0, &HAND, &floats(sample)).unwrap();
            close("phase", k, filter.phase(), at("phase"), 1e-8);
            close(
                "velocity",
                k,
                filter.phase_velocity(),
                at("phase_vel"),
                1e-8,
            );
            for (j, want) in floats(&want["q_final"][k]).into_iter().enumerate() {
                close("arm", k, filter.mean_at(1.0, 18 + j).unwrap(), want, 1e-6);
            }
        }
    }
}

/// Random smooth motions of `dofs` values: a cubic with random coefficients plus noise.
fn motions(seed: u64, count: usize, dofs: usize, noise: f64) -> Vec<Demonstration> {
    let mut sampler = Sampler::new(seed);
    (0..count)
        .map(|_| {
            let samples = 40 + sampler.index(60);
            let shape: Vec<[f64; 4]> = (0..dofs)
                .map(|d| {
                    let x = [0; 4].map(|_| 0.2 * sampler.normal());
                    [x[0] + d as f64, x[1] + 1.0, x[2], x[3]]
                })
                .collect();
            let mut values = Vec::new();
            for k in 0..samples {
                let t = k as f64 / (samples - 1) as f64;
                for [a, b, c, d] in &shape {
                    values.push(a + t * (b + t * (c + t * d)) + noise * sampler.normal());
                }
            }
            Demonstration::from_samples(1.0, dofs, values).unwrap()
        })
        .collect()
}

/// All observed, so that the published convention is the textbook one too.
#[test]
fn low_rank_filter_equals_full_state() {
    for (seed, basis) in [
        (2, Basis::Polynomial { count: 4 }),
        (3, Basis::Legendre { count: 6 }),
        (4, Basis::normalized_gaussian(5)),
        (5, Basis::gaussian(5)),
    ] {
        let demonstrations = motions(seed, 9, 4, 0.01);
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
        let unseen = &motions(seed + 100, 1, 4, 0.01)[0];
        for k in 0..unseen.len() {
            let dt = [1.0, 0.4, 1.7][k % 3];
            low.predict(dt).unwrap();
            low.observe(&Observation::new(&[0, 1, 2, 3], unseen.sample(k)))
                .unwrap();
            full.step(dt, &[0, 1, 2, 3], unseen.sample(k)).unwrap();
            assert!((low.phase() - full.phase()).abs() < 1e-8, "{basis:?} {k}");
            let (mut mean, mut variance) = ([0.0; 4], [0.0; 4]);
            low.moments_at(1.0, &[0, 1, 2, 3], &mut mean, &mut variance)
                .unwrap();
            for (d, mean) in mean.iter().enumerate() {
                assert!((mean - full.mean_at(1.0, d).unwrap()).abs() < 1e-6);
                let full_variance = full.variance_at(1.0, d).unwrap();
                assert!((variance[d] / full_variance - 1.0).abs() < 1e-6);
            }
        }
    }
}
