//! A model and its filter depend neither on the order of the demonstrations and columns, nor on the offset, sign and unit of the values, nor on the
//! unit of time.

use crate::common::{moments, reaches, trained};
use hwall_bip::{Basis, Demonstration, Filter, FilterConfig, Observation};

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
    let model = trained(&demonstrations, basis);
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

type Change = fn([f64; DOFS]) -> [f64; DOFS];

/// Changes of the order, the values and the clock, which must change means and deviations likewise: name, unit of time, change of
/// the values, allowed difference of the means.
const CASES: [(&str, f64, Change, f64); 8] = [
    ("order", 1.0, |row| row, 1e-7),
    ("columns", 1.0, |[a, b, c]| [c, a, b], 1e-7),
    ("mirror", 1.0, |row| row.map(|x| -x), 1e-7),
    ("unit", 1.0, |row| row.map(|x| 1e3 * x), 1e-6),
    ("units", 1.0, |[a, b, c]| [a, 1e3 * b, 1e-3 * c], 1e-6),
    ("72 samples a unit of time", 1.0 / 72.0, |row| row, 1e-6),
    ("a sample in 13.9 units", 13.9, |row| row, 1e-6),
    ("place", 1.0, |[a, b, c]| [a + 2.0, b - 3.0, c + 1.0], 1e-5),
];

#[test]
fn order_place_sense_and_units_do_not_matter() {
    let training = rows(1, 14);
    let mut reordered = training.clone();
    reordered.reverse();
    reordered.rotate_left(5);
    for basis in BASES {
        let nominal = said(basis, &training, 1.0, |row| row);
        for (name, period_s, of, close) in CASES {
            // A polynomial contains a constant exactly; bell-shaped functions contain it only nearly.
            if name == "place" && !matches!(basis, Basis::Legendre { .. }) {
                continue;
            }
            let training = match name {
                "order" => &reordered,
                _ => &training,
            };
            let zero = of([0.0; DOFS]);
            let spread = |sd: [f64; DOFS]| {
                let moved = of(sd);
                [0, 1, 2].map(|d| (moved[d] - zero[d]).abs())
            };
            let scale = spread([1.0; DOFS]);
            let found = said(basis, training, period_s, of);
            assert_eq!(nominal.len(), found.len());
            for ([mean, variance], [other, others]) in nominal.iter().zip(&found) {
                let (mean, sd) = (of(*mean), spread(variance.map(f64::sqrt)));
                for d in 0..DOFS {
                    let (x, y) = (mean[d], other[d]);
                    assert!((x - y).abs() < close * scale[d], "{name}: {x} {y}");
                    let (v, w) = (sd[d].powi(2), others[d]);
                    assert!((v / w - 1.0).abs() < 1e3 * close, "{name}: {v} {w}");
                }
            }
        }
    }
}
