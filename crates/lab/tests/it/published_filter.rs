//! The published filter against the published implementation and against the exact filter.

use hwall_bip::{
    Basis, Demonstration, Filter, FilterConfig, Group, Model, MotionFilter, NoiseSource,
    Observation, PhaseVelocity, Prior, TrainingConfig,
};
use hwall_lab::bip::published_filter::FullFilter;
use hwall_testkit::Sampler;
use serde_json::Value;
use std::path::Path;

/// The hand, in the columns of the workload.
const HAND: [usize; 18] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17];

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

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
        println!("{name}: {:?}", self.0);
        let within = self
            .0
            .iter()
            .zip(tolerances)
            .all(|(off, most)| *off <= most);
        assert!(within, "{name}: {:?}", self.0);
    }
}

fn groups(basis: Basis) -> Vec<Group> {
    vec![
        Group::observed("hand", 18, basis),
        Group::controlled("arm", 7, basis),
    ]
}

/// The excerpt in the tests of `hwall-bip`, described in the README there.
fn excerpt() -> (Prior, Value) {
    let data = json(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../bip/tests/data/poly_b4.json"));
    let number = |key: &str| data[key].as_f64().unwrap();
    let basis = Basis::Polynomial { count: 4 };
    let prior = Prior {
        offset: vec![0.0; 25],
        groups: groups(basis),
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

/// Values of a motion of the workload, one sample after the other.
fn samples(path: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap();
    let cells = text.lines().skip(1).flat_map(|line| line.split(','));
    cells.map(|cell| cell.parse().unwrap()).collect()
}

/// On the samples where rounding does not decide.
#[test]
fn agrees_with_all_runs_of_the_published_filter() {
    let Some(reference) = hwall_testkit::shared("reference/bip") else {
        return;
    };
    let motion = |name: String| samples(&reference.join("workload").join(name));
    let demonstrations: Vec<Demonstration> = (0..47)
        .map(|i| motion(format!("train_{i:03}.csv")))
        .map(|values| Demonstration::from_samples(1.0, 25, values).unwrap())
        .collect();
    for (case, basis) in [
        ("poly_B4", Basis::Polynomial { count: 4 }),
        ("poly_B8", Basis::Polynomial { count: 8 }),
        ("gaussS_B6", Basis::gaussian(6)),
    ] {
        let config = TrainingConfig::published(groups(basis));
        let prior = Model::train(&demonstrations, &config).unwrap().to_prior();
        let runs = json(&reference.join(case).join("ekf_intprim.json"));
        let mut off = Differences::default();
        for run in runs["tests"].as_array().unwrap() {
            let mut filter = FullFilter::new(&prior, 1e-4, 1e-8).unwrap();
            let id = run["id"].as_u64().unwrap();
            let values = motion(format!("test_{id:03}.csv"));
            let sound = run["roundoff_ok_steps"]
                .as_u64()
                .map_or(usize::MAX, |n| n as usize);
            for (k, sample) in values.chunks(25).take(sound).enumerate() {
                step(&mut filter, 1.0, &HAND, &sample[..18]);
                off.take(k, run, &mut filter);
            }
        }
        off.check(case, [1e-7, 1e-6, 1e-5, 1e-7, 5e-6]);
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

/// All columns observed, so that the published convention equals the textbook filter.
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
