//! Trees on top of a regression, in units of its typical error.

use super::local_ridge::{Fitted, Rows, by_region};
use super::trees::{Lessons, Trees};
use crate::learned::quantiles::{SENSOR_M, weighted_quantile};
use crate::learned::reaches::samples::TrainingSample;
use glam::DVec3;
use hwall_numeric::dense::Matrix;

/// Trees on top of a regression.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::learned) struct Correction {
    pub(in crate::learned) trees: Trees,
    /// Mean square of the error of the regression in each region, m²: the unit of the corrections.
    pub(in crate::learned) squares_m2: Vec<f64>,
}

impl Correction {
    /// Inputs of the trees: the features; the remaining displacement and time by the regression relative to the start; the end by the regression
    /// that uses the place in the room.
    pub(in crate::learned) fn features_into(
        features: &[f64],
        now_m: DVec3,
        outputs: [&[f64]; 2],
        out: &mut Vec<f64>,
    ) {
        out.clear();
        out.extend_from_slice(features);
        out.extend_from_slice(&outputs[1][..4]);
        out.extend((now_m + DVec3::from_slice(&outputs[0][..3])).to_array());
    }

    /// Number of features that [`features_into`](Self::features_into) adds.
    pub(in crate::learned) const ADDED: usize = 7;

    /// Unit of the corrections at a progress, m.
    fn unit_m(&self, gates: &[f64]) -> f64 {
        let pairs = gates.iter().zip(&self.squares_m2);
        pairs.map(|(g, s)| g * s).sum::<f64>().sqrt()
    }

    /// The correction, m.
    pub(in crate::learned) fn at(&self, features: &[f64], gates: &[f64]) -> DVec3 {
        DVec3::from_array(self.trees.correction(features)) * self.unit_m(gates)
    }

    /// The trees, and the held-out ends after correction, m.
    pub(super) fn of(
        samples: &[TrainingSample],
        rows: &Rows,
        fitted: &[Fitted; 2],
    ) -> (Self, Vec<DVec3>) {
        let outputs =
            |k: usize, row: usize| &fitted[k].held_out[row * rows.outputs..][..rows.outputs];
        let miss = |row: usize| {
            let s = &samples[row];
            s.end_m - s.now_m - DVec3::from_slice(&outputs(1, row)[..3])
        };
        let squares: Vec<f64> = (0..rows.len())
            .map(|row| miss(row).length_squared())
            .collect();
        let limit = 16.0 * weighted_quantile(0.5, squares.iter().map(|s| (*s, 1.0)));
        let clipped: Vec<f64> = squares.iter().map(|s| s.min(limit)).collect();
        let mut correction = Self {
            trees: Trees::default(),
            squares_m2: by_region(rows, &clipped)
                .into_iter()
                .map(|s| s + 3.0 * SENSOR_M * SENSOR_M)
                .collect(),
        };
        let units: Vec<f64> = (0..rows.len())
            .map(|row| correction.unit_m(rows.gates(row)))
            .collect();
        let mut features = Vec::with_capacity(rows.len() * (rows.width + Self::ADDED));
        let mut own = Vec::new();
        for (row, s) in samples.iter().enumerate() {
            Self::features_into(
                &s.features,
                s.now_m,
                [outputs(0, row), outputs(1, row)],
                &mut own,
            );
            features.extend_from_slice(&own);
        }
        let wanted = |row: usize| (miss(row) / units[row]).clamp_length_max(4.0).to_array();
        let lessons = Lessons {
            features: Matrix::from_rows(rows.len(), rows.width + Self::ADDED, features),
            wanted: (0..rows.len()).map(wanted).collect(),
            weights: samples.iter().map(|s| s.weight).collect(),
            folds: rows.folds.clone(),
        };
        let (trees, held_out) = Trees::fit(&lessons);
        correction.trees = trees;
        let corrected = |row: usize| {
            let way_m = DVec3::from_slice(&outputs(1, row)[..3]);
            samples[row].now_m + way_m + DVec3::from_array(held_out[row]) * units[row]
        };
        let corrected_m = (0..rows.len()).map(corrected).collect();
        (correction, corrected_m)
    }
}
