//! Primitive and regression, and what they predict of reaches that were held out.

use super::config::LearnedConfig;
use super::gates::Gates;
use super::held_out_errors::{SENSOR_M, weighted_quantile};
use super::local_ridge::{Fitted, LocalRidge, Rows};
use super::primitive::{Primitive, PrimitiveRun, Training, demonstration};
use super::reach_track::{Inputs, ReachTrack};
use super::samples::{SampleTimes, TrainingSample};
use crate::error::ContactError;
use glam::DVec3;
use hwall_bip::Demonstration;
use hwall_hand::LabelledReach;

/// Way left (3), time left (1), normal (3).
pub(super) const OUTPUTS: usize = 7;
/// Reaches are held out from primitives in this many parts: a primitive changes little with a fifth of its
/// reaches, and takes longer to train than a regression.
const PRIMITIVE_PARTS: usize = 5;
/// Candidates for the ridge, as shares of the mean squared length of a row.
const RIDGES: [f64; 8] = [1e-4, 1e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 10.0];
/// The ridge with which the usual error of each region is measured.
const PILOT_RIDGE: f64 = 3e-2;
/// More points of the hand must improve a source by this share: they cost time in every step.
const WORTH: f64 = 0.05;

/// Adds to every sample where its reach ends by a primitive that was trained without its fold, and
/// returns the primitive trained on all reaches.
///
/// It is one of the touching point alone, unless one of all points of the hand is clearly better on held-out
/// reaches.
pub(super) fn primitive(
    inputs: &Inputs,
    reaches: &[&LabelledReach],
    folds: &[usize],
    samples: &mut [TrainingSample],
    config: &LearnedConfig,
) -> Result<Primitive, ContactError> {
    let mut best: Option<(f64, Training, Vec<Demonstration>)> = None;
    let mut points = vec![1, inputs.points()];
    points.dedup();
    for points in points {
        let demonstrations: Vec<Demonstration> = reaches
            .iter()
            .map(|r| demonstration(inputs, points, r))
            .collect::<Result<_, _>>()?;
        let training = Training::tuned(config, points, &demonstrations)?;
        let predicted = held_out(inputs, reaches, &demonstrations, folds, &training, config)?;
        // A primitive that has lost its way counts as predicting that the hand stays where it is.
        let misses = samples
            .iter()
            .zip(&predicted)
            .map(|(s, predicted)| predicted.unwrap_or(s.now_m).distance(s.end_m));
        let mean = robust_mean(misses.zip(samples.iter().map(|s| s.weight)));
        if best
            .as_ref()
            .is_none_or(|(least, ..)| mean < (1.0 - WORTH) * least)
        {
            for (sample, predicted) in samples.iter_mut().zip(predicted) {
                sample.primitive_m = predicted;
            }
            best = Some((mean, training, demonstrations));
        }
    }
    // There is always a first.
    let Some((_, training, demonstrations)) = best else {
        return Err(ContactError::TooFewReaches { got: 0, needed: 1 });
    };
    training.primitive(reaches.iter().copied().zip(&demonstrations))
}

/// Mean with values clipped to four times the median; `values` are pairs of value and weight.
fn robust_mean(values: impl Iterator<Item = (f64, f64)>) -> f64 {
    let values: Vec<(f64, f64)> = values.collect();
    let limit = 4.0 * weighted_quantile(0.5, values.iter().copied());
    let total: f64 = values.iter().map(|v| v.1).sum();
    values.iter().map(|(x, w)| x.min(limit) * w).sum::<f64>() / total
}

/// Where the reach of every sample ends by a primitive that was trained without its fold, m; `None` where
/// that has lost its way. In the order of the samples.
fn held_out(
    inputs: &Inputs,
    reaches: &[&LabelledReach],
    demonstrations: &[Demonstration],
    folds: &[usize],
    training: &Training,
    config: &LearnedConfig,
) -> Result<Vec<Option<DVec3>>, ContactError> {
    let mut predicted: Vec<Vec<Option<DVec3>>> = vec![Vec::new(); reaches.len()];
    // A part is made of whole folds, so a primitive never knows what it is asked about.
    let part_of = |fold: usize| fold % PRIMITIVE_PARTS;
    let count = 1 + folds.iter().map(|f| part_of(*f)).max().unwrap_or(0);
    for part in 0..count {
        let others = reaches.iter().copied().zip(demonstrations).zip(folds);
        let others = others
            .filter(|(_, f)| part_of(**f) != part)
            .map(|(pair, _)| pair);
        let primitive = training.primitive(others)?;
        let mut run = PrimitiveRun::new(&primitive);
        let asked = reaches
            .iter()
            .enumerate()
            .filter(|(i, _)| part_of(folds[*i]) == part);
        for (i, reach) in asked {
            let mut track = ReachTrack::new(inputs);
            let mut due = SampleTimes::new(reach, config.samples_per_reach);
            run.begin();
            for (k, frame) in reach.frames.iter().enumerate() {
                if !track.push(frame) {
                    continue;
                }
                run.step(inputs, &track)?;
                if due.is_due(k, frame.t_s) {
                    predicted[i].push(run.end()?);
                }
            }
        }
    }
    Ok(predicted.concat())
}

/// The regression and what it predicts for samples whose fold is held out.
///
/// The other points of the hand are used only if that is clearly better on held-out reaches: a hand held in
/// a way that had never been seen misled a regression by centimetres.
pub(super) fn regression(
    inputs: &Inputs,
    samples: &[TrainingSample],
    gates: &Gates,
    normals: bool,
) -> Result<(Rows, Fitted), ContactError> {
    let groups = match normals {
        true => vec![0..3, 3..4, 4..7],
        false => vec![0..3, 3..4],
    };
    let [all, first] = inputs.widths();
    let mut best: Option<(f64, Rows, Fitted)> = None;
    let mut judged_by: Option<Vec<f64>> = None;
    for width in if all == first {
        vec![first]
    } else {
        vec![first, all]
    } {
        let mut rows = rows(samples, width, gates, normals);
        let even = LocalRidge::fit(&rows, &groups, &[PILOT_RIDGE])?;
        weigh(&mut rows, &even.held_out);
        let fitted = LocalRidge::fit(&rows, &groups, &RIDGES)?;
        let predicted = fitted.held_out.chunks_exact(rows.outputs);
        let misses = samples.iter().zip(predicted).map(|(s, predicted)| {
            let end_m = s.now_m + DVec3::from_slice(&predicted[..3]);
            end_m.distance(s.end_m)
        });
        // The same weights for both, so that neither chooses how it is judged.
        let weights = judged_by.get_or_insert_with(|| rows.weights.clone());
        let mean = robust_mean(misses.zip(weights.iter().map(|w| w.sqrt())));
        if best
            .as_ref()
            .is_none_or(|(least, ..)| mean < (1.0 - WORTH) * least)
        {
            best = Some((mean, rows, fitted));
        }
    }
    // There is always a first.
    best.map(|(_, rows, fitted)| (rows, fitted))
        .ok_or(ContactError::TooFewReaches { got: 0, needed: 1 })
}

/// Regions of progress over samples.
pub(super) fn gates(samples: &[TrainingSample], count: usize) -> Gates {
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

/// Weights samples by one over the squared error that is usual in their region: otherwise the first and
/// uncertain ones decide the shared coefficients, at the cost of the last, nearly certain ones.
fn weigh(rows: &mut Rows, held_out: &[f64]) {
    let squares: Vec<f64> = (0..rows.len())
        .map(|row| {
            let at = row * rows.outputs;
            (at..at + 3)
                .map(|k| (held_out[k] - rows.wanted[k]).powi(2))
                .sum()
        })
        .collect();
    let usual = by_region(rows, &squares);
    for row in 0..rows.len() {
        let expected: f64 = rows.gates(row).iter().zip(&usual).map(|(g, u)| g * u).sum();
        rows.weights[row] /= expected + 3.0 * SENSOR_M * SENSOR_M;
    }
}

/// Mean of the values of all rows, by region.
fn by_region(rows: &Rows, values: &[f64]) -> Vec<f64> {
    (0..rows.regions)
        .map(|region| {
            let (mut sum, mut weight) = (0.0, f64::MIN_POSITIVE);
            for (row, value) in values.iter().enumerate() {
                let gate = rows.gates(row)[region];
                sum += gate * value;
                weight += gate;
            }
            sum / weight
        })
        .collect()
}
