//! The regression of the remaining displacement and its held-out predictions.

use super::correction::Correction;
use super::gates::Gates;
use super::local_ridge::{Blocks, Fitted, LocalRidge, Rows, by_region};
use crate::error::ContactError;
use crate::learned::config::LearnedConfig;
use crate::learned::quantiles::SENSOR_M;
use crate::learned::reaches::reach_track::{BlockKind, Inputs};
use crate::learned::reaches::samples::TrainingSample;
use glam::DVec3;

/// Remaining displacement (3), remaining time (1), normal (3).
pub(in crate::learned) const OUTPUTS: usize = 7;
/// Candidates for the ridge, as shares of the mean squared length of a row.
const RIDGES: [f64; 8] = [1e-4, 1e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 10.0];
/// The ridge for measuring the typical error of each region.
const PILOT_RIDGE: f64 = 3e-2;

/// A regression with its training data and held-out predictions.
pub(in crate::learned) struct Regression {
    pub(in crate::learned) gates: Gates,
    pub(in crate::learned) rows: Rows,
    /// With the place in the room, and without.
    pub(in crate::learned) fitted: [Fitted; 2],
    pub(in crate::learned) correction: Correction,
    /// Held-out end of each reach by the corrected regression, m, in the order of the samples.
    pub(in crate::learned) corrected_m: Vec<DVec3>,
}

/// Candidate numbers of regions.
const REGIONS: [usize; 4] = [16, 32, 64, 128];
/// Largest number of samples for choosing the number of regions.
const TRIED_ON: usize = 16_000;
/// More regions must lower the error by at least this share.
const WORTH_REGIONS: f64 = 0.005;

/// The regression and its held-out predictions for the samples.
pub(in crate::learned) fn regression(
    inputs: &Inputs,
    samples: &[TrainingSample],
    config: &LearnedConfig,
    normals: bool,
) -> Result<Regression, ContactError> {
    let groups = match normals {
        true => vec![0..3, 3..4, 4..7],
        false => vec![0..3, 3..4],
    };
    let columns: Vec<_> = inputs.blocks().into_iter().map(|b| b.columns).collect();
    let everywhere = Blocks {
        allowed: vec![true; columns.len()],
        columns,
        tried: false,
        reaches: samples.iter().map(|s| s.weight).sum(),
    };
    let width = inputs.width();
    let regions = match config.regions {
        Some(regions) => regions,
        None => {
            let step = samples.len().div_ceil(TRIED_ON).max(1);
            let some: Vec<TrainingSample> = samples.iter().step_by(step).cloned().collect();
            let mut best = (f64::INFINITY, 1);
            for regions in REGIONS {
                let gates = gates(&some, regions);
                let rows = rows(&some, width, &gates, false);
                let fitted = LocalRidge::fit(
                    &rows,
                    &[0..3, 3..4],
                    &[PILOT_RIDGE],
                    std::slice::from_ref(&everywhere),
                )?
                .remove(0);
                let score = log_error(&some, &fitted.held_out, rows.outputs);
                if score < best.0 - WORTH_REGIONS {
                    best = (score, regions);
                }
                // No more regions than distinct samples.
                if gates.len() < regions {
                    break;
                }
            }
            best.1
        }
    };
    let gates = gates(samples, regions);
    let mut rows = rows(samples, width, &gates, normals);
    let one = std::slice::from_ref(&everywhere);
    let even = LocalRidge::fit(&rows, &groups, &[PILOT_RIDGE], one)?.remove(0);
    weigh(&mut rows, &even.held_out);
    let room = Blocks {
        tried: true,
        ..everywhere
    };
    let mut start = room.clone();
    for (allowed, block) in start.allowed.iter_mut().zip(inputs.blocks()) {
        *allowed = block.kind != BlockKind::Start;
    }
    let mut fitted = LocalRidge::fit(&rows, &groups, &RIDGES, &[room, start])?.into_iter();
    match (fitted.next(), fitted.next()) {
        (Some(room), Some(start)) => {
            let fitted = [room, start];
            let (correction, corrected_m) = Correction::of(samples, &rows, &fitted);
            Ok(Regression {
                gates,
                rows,
                fitted,
                correction,
                corrected_m,
            })
        }
        _ => Err(ContactError::Singular { size: width + 1 }),
    }
}

/// Mean logarithm of the errors of predicted ends, so that early and late samples count equally.
fn log_error(samples: &[TrainingSample], held_out: &[f64], outputs: usize) -> f64 {
    let (mut sum, mut total) = (0.0, f64::MIN_POSITIVE);
    for (s, predicted) in samples.iter().zip(held_out.chunks_exact(outputs)) {
        let miss_m = s.now_m + DVec3::from_slice(&predicted[..3]) - s.end_m;
        sum += s.weight * 0.5 * (miss_m.length_squared() + LEAST_ERROR_M * LEAST_ERROR_M).ln();
        total += s.weight;
    }
    sum / total
}

/// Smaller errors are raised to this value when errors are compared, m.
const LEAST_ERROR_M: f64 = 2e-3;

/// Regions of progress over the samples.
fn gates(samples: &[TrainingSample], count: usize) -> Gates {
    let progress: Vec<_> = samples.iter().map(|s| s.progress).collect();
    Gates::of(&progress, count)
}

fn rows(samples: &[TrainingSample], width: usize, gates: &Gates, normals: bool) -> Rows {
    let mut rows = Rows {
        width,
        regions: gates.len(),
        outputs: if normals { OUTPUTS } else { OUTPUTS - 3 },
        ..Rows::default()
    };
    let mut weights = Vec::new();
    for s in samples {
        rows.features.extend(&s.features[..width]);
        gates.weights_into(&s.progress, &mut weights);
        rows.gates.extend(&weights);
        rows.wanted.extend((s.end_m - s.now_m).to_array());
        rows.wanted.push(s.left_s);
        if let Some(normal) = s.normal.filter(|_| normals) {
            rows.wanted.extend(normal.to_array());
        }
        rows.weights.push(s.weight);
        rows.folds.push(s.fold);
    }
    rows
}

/// Weights samples by the inverse of the typical squared error in their region: otherwise the early, uncertain samples dominate the shared
/// coefficients, at the cost of the late, nearly certain ones.
fn weigh(rows: &mut Rows, held_out: &[f64]) {
    let squares: Vec<f64> = (0..rows.len())
        .map(|row| {
            let at = row * rows.outputs;
            (at..at + 3)
                .map(|k| (held_out[k] - rows.wanted[k]).powi(2))
                .sum()
        })
        .collect();
    let nominal = by_region(rows, &squares);
    for row in 0..rows.len() {
        let expected: f64 = rows
            .gates(row)
            .iter()
            .zip(&nominal)
            .map(|(g, u)| g * u)
            .sum();
        rows.weights[row] /= expected + 3.0 * SENSOR_M * SENSOR_M;
    }
}
