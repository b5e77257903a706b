//! Reads the reference files and their excerpt; steps of filters.

use hwall_bip::{
    Basis, Demonstration, Group, Model, MotionFilter, Observation, PhaseVelocity, Prior,
    TrainingConfig,
};
use hwall_testkit::{Sampler, minimum_jerk};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Columns of the hand in the workload.
pub(crate) const HAND: [usize; 18] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17];
pub(crate) const DOFS: usize = 25;

/// The reference folder next to the project, or `None` with a message.
pub(crate) fn reference() -> Option<PathBuf> {
    hwall_testkit::shared("reference/bip")
}

pub(crate) fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Rows of a CSV file with one header line.
pub(crate) fn csv(path: &Path) -> Vec<Vec<f64>> {
    std::fs::read_to_string(path)
        .unwrap()
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|x| x.parse().unwrap()).collect())
        .collect()
}

/// One demonstration, one sample per unit of time.
pub(crate) fn demonstration(path: &Path) -> Demonstration {
    Demonstration::from_samples(1.0, DOFS, csv(path).concat()).unwrap()
}

pub(crate) fn training_set(reference: &Path) -> Vec<Demonstration> {
    (0..47)
        .map(|i| demonstration(&reference.join(format!("workload/train_{i:03}.csv"))))
        .collect()
}

/// The three cases of the reference.
pub(crate) fn cases() -> [(&'static str, Basis); 3] {
    [
        ("poly_B4", Basis::Polynomial { count: 4 }),
        ("poly_B8", Basis::Polynomial { count: 8 }),
        ("gaussS_B6", Basis::gaussian(6)),
    ]
}

pub(crate) fn groups(basis: Basis) -> Vec<Group> {
    vec![
        Group::observed("hand", 18, basis),
        Group::controlled("arm", 7, basis),
    ]
}

/// The training of one observed group.
pub(crate) fn one_group(dofs: usize, basis: Basis) -> TrainingConfig {
    TrainingConfig::new(vec![Group::observed("hand", dofs, basis)])
}

/// A model of one observed group.
pub(crate) fn trained(demonstrations: &[Demonstration], basis: Basis) -> Model {
    Model::train(demonstrations, &one_group(demonstrations[0].dofs(), basis)).unwrap()
}

/// Values and slopes of the functions of a basis.
pub(crate) fn evaluate(basis: Basis, phase: f64) -> (Vec<f64>, Vec<f64>) {
    let (mut values, mut slopes) = (vec![0.0; basis.count()], vec![0.0; basis.count()]);
    basis
        .evaluate_into(phase, &mut values, &mut slopes)
        .unwrap();
    (values, slopes)
}

/// Prior and test runs of the excerpt in `tests/data`, rounded to 13 digits; its filter with the published convention is for `hwall-lab`.
pub(crate) fn excerpt() -> (Prior, Value) {
    let data: Value = serde_json::from_str(include_str!("../../data/poly_b4.json")).unwrap();
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

/// One sample, a unit of time after the last.
pub(crate) fn step(filter: &mut impl MotionFilter, dofs: &[usize], values: &[f64]) {
    filter.predict(1.0).unwrap();
    filter.observe(&Observation::new(dofs, values)).unwrap();
}

/// Mean and variance at a phase.
pub(crate) fn moments<const N: usize>(
    filter: &mut impl MotionFilter,
    phase: f64,
    dofs: [usize; N],
) -> [[f64; N]; 2] {
    let [mut mean, mut variance] = [[0.0; N]; 2];
    let found = filter.moments_at(phase, &dofs, &mut mean, &mut variance);
    found.unwrap();
    [mean, variance]
}

pub(crate) fn floats(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}

/// Reaches of `dofs` values towards random targets, of different lengths.
pub(crate) fn reaches(seed: u64, count: usize, dofs: usize) -> Vec<Demonstration> {
    let mut sampler = Sampler::new(seed);
    (0..count)
        .map(|_| {
            let samples = 30 + sampler.index(40);
            let target: Vec<f64> = (0..dofs).map(|_| sampler.uniform(-0.3, 0.3)).collect();
            let mut values = Vec::new();
            for k in 0..samples {
                let t = k as f64 / (samples - 1) as f64;
                let reached = minimum_jerk(t);
                for (d, goal) in target.iter().enumerate() {
                    let start = 0.1 * d as f64;
                    let noise = 1e-3 * sampler.normal();
                    values.push(start + reached * (0.5 + goal) + noise);
                }
            }
            Demonstration::from_samples(1.0, dofs, values).unwrap()
        })
        .collect()
}

/// Random smooth motions of `dofs` values: a cubic with random coefficients plus noise.
pub(crate) fn cubics(seed: u64, count: usize, dofs: usize, noise: f64) -> Vec<Demonstration> {
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
