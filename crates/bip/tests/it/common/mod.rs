//! Reads the reference files and their excerpt; steps of filters.

use hwall_bip::{Basis, Demonstration, Group, MotionFilter, Observation};
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
