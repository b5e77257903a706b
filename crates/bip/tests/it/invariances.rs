//! A model and its filter depend neither on the order of the demonstrations and columns, nor on the offset, sign and unit of the values, nor on the
//! unit of time.

use crate::common::{moments, reaches};
use hwall_bip::{
    Basis, Demonstration, Filter, FilterConfig, Group, Model, Observation, TrainingConfig,
};

const DOFS: usize = 3;
const BASES: [Basis; 2] = [
    Basis::Legendre { count: 6 },
    Basis::NormalizedGaussian {
        count: 7,
        variance: 0.02,
    },
];

type Rows = Vec<[f64; DOFS]>;

/// Reaches as rows of values.
fn rows(seed: u64, count: usize) -> Vec<Rows> {
    let row = |reach: &Demonstration, k| std::array::from_fn(|d| reach.sample(k)[d]);
    let reaches = reaches(seed, count, DOFS);
    let of = |reach: &Demonstration| (0..reach.len()).map(|k| row(reach, k)).collect();
    reaches.iter().map(of).collect()
}

/// The predicted end after every third of a motion, as means and variances.
fn said(
    basis: Basis,
    training: &[Rows],
    period_s: f64,
    of: impl Fn([f64; DOFS]) -> [f64; DOFS],
) -> Vec<[[f64; DOFS]; 2]> {
    let demonstration = |rows: &Rows| {
        let values: Vec<f64> = rows.iter().flat_map(|row| of(*row)).collect();
        Demonstration::from_samples(period_s, DOFS, values).unwrap()
    };
    let demonstrations: Vec<_> = training.iter().map(demonstration).collect();
    let config = TrainingConfig::new(vec![Group::observed("hand", DOFS, basis)]);
    let model = Model::train(&demonstrations, &config).unwrap();
    let mut said = Vec::new();
    for motion in rows(99, 4) {
        let mut filter = Filter::new(&model, &FilterConfig::default()).unwrap();
        for (k, row) in motion.iter().take(30).enumerate() {
            filter.predict(period_s).unwrap();
            filter
                .observe(&Observation::new(&[0, 1, 2], &of(*row)))
                .unwrap();
            if k % 10 == 9 {
                said.push(moments(&mut filter, 1.0, [0, 1, 2]));
            }
        }
    }
    said
}

/// Compares with transformed values: the means transform like the values, the variances by the square of the scale.
fn compare(
    name: &str,
    a: &[[[f64; DOFS]; 2]],
    b: &[[[f64; DOFS]; 2]],
    of: impl Fn([f64; DOFS]) -> [f64; DOFS],
    scale: f64,
    close: f64,
) {
    assert_eq!(a.len(), b.len());
    for ([mean, variance], [other, others]) in a.iter().zip(b) {
        for (x, y) in of(*mean).iter().zip(other) {
            assert!((x - y).abs() < close * scale, "{name}: {x} {y}");
        }
        let (mut v, mut w) = (*variance, *others);
        v.sort_by(f64::total_cmp);
        w.sort_by(f64::total_cmp);
        for (v, w) in v.iter().zip(w) {
            assert!(
                (scale * scale * v / w - 1.0).abs() < 1e3 * close,
                "{name}: {v} {w}"
            );
        }
    }
}

#[test]
fn demonstrations_and_columns_come_in_any_order() {
    for basis in BASES {
        let training = rows(1, 14);
        let nominal = said(basis, &training, 1.0, |row| row);
        let mut others = training.clone();
        others.reverse();
        others.rotate_left(5);
        compare(
            "order",
            &nominal,
            &said(basis, &others, 1.0, |row| row),
            |row| row,
            1.0,
            1e-7,
        );
        let columns = |[a, b, c]: [f64; DOFS]| [c, a, b];
        compare(
            "columns",
            &nominal,
            &said(basis, &training, 1.0, columns),
            columns,
            1.0,
            1e-7,
        );
    }
}

#[test]
fn place_sense_and_unit_of_the_values_and_of_time_do_not_matter() {
    for basis in BASES {
        let training = rows(2, 14);
        let nominal = said(basis, &training, 1.0, |row| row);
        let mirror = |row: [f64; DOFS]| row.map(|x| -x);
        compare(
            "mirror",
            &nominal,
            &said(basis, &training, 1.0, mirror),
            mirror,
            1.0,
            1e-7,
        );
        let larger = |row: [f64; DOFS]| row.map(|x| 1e3 * x);
        compare(
            "unit",
            &nominal,
            &said(basis, &training, 1.0, larger),
            larger,
            1e3,
            1e-6,
        );
        for period_s in [1.0 / 72.0, 13.9] {
            compare(
                "time",
                &nominal,
                &said(basis, &training, period_s, |row| row),
                |row| row,
                1.0,
                1e-6,
            );
        }
    }
}

/// A polynomial contains a constant exactly; bell-shaped functions contain it only nearly, so they are not tested.
#[test]
fn the_origin_of_the_values_does_not_matter() {
    let training = rows(3, 14);
    let nominal = said(BASES[0], &training, 1.0, |row| row);
    let elsewhere = |row: [f64; DOFS]| [row[0] + 2.0, row[1] - 3.0, row[2] + 1.0];
    compare(
        "place",
        &nominal,
        &said(BASES[0], &training, 1.0, elsewhere),
        elsewhere,
        1.0,
        1e-5,
    );
}
