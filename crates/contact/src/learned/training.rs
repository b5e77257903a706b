//! Primitive and regression, and what they predict of reaches that were held out.

use super::config::LearnedConfig;
use super::gates::Gates;
use super::local_ridge::{Blocks, Fitted, LocalRidge, Rows};
use super::primitive::{Primitive, PrimitiveRun, Training, demonstration};
use super::quantiles::{SENSOR_M, weighted_quantile};
use super::reach_track::{BlockKind, Inputs, ReachTrack};
use super::samples::{SampleTimes, TrainingSample};
use super::trees::{Lessons, Trees};
use crate::error::ContactError;
use glam::DVec3;
use hwall_bip::Demonstration;
use hwall_hand::LabelledReach;
use hwall_numeric::dense::Matrix;

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

/// A regression, what it is learnt from and where it is right.
pub(super) struct Regression {
    pub(super) gates: Gates,
    pub(super) rows: Rows,
    /// With the place in the room, and without.
    pub(super) fitted: [Fitted; 2],
    pub(super) correction: Correction,
    /// Where each reach ends by the corrected regression when its fold is held out, m, in the order of the samples.
    pub(super) corrected_m: Vec<DVec3>,
}

/// Trees on top of a regression.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Correction {
    pub(super) trees: Trees,
    /// Mean square of the error of the regression in each region, m²: the unit of the corrections.
    pub(super) squares_m2: Vec<f64>,
}

impl Correction {
    /// What the trees see: the features, then what the regressions say of them: the way left and the time by the one
    /// that knows only the reach, and the end in the room by the other.
    pub(super) fn features_into(
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

    /// Numbers that [`features_into`](Self::features_into) adds.
    pub(super) const ADDED: usize = 7;

    /// The unit of the corrections at a progress, m.
    fn unit_m(&self, gates: &[f64]) -> f64 {
        let pairs = gates.iter().zip(&self.squares_m2);
        pairs.map(|(g, s)| g * s).sum::<f64>().sqrt()
    }

    /// The correction, m.
    pub(super) fn at(&self, features: &[f64], gates: &[f64]) -> DVec3 {
        DVec3::from_array(self.trees.correction(features)) * self.unit_m(gates)
    }

    /// The trees, and what the correction makes of held-out ends, m.
    fn of(samples: &[TrainingSample], rows: &Rows, fitted: &[Fitted; 2]) -> (Self, Vec<DVec3>) {
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

/// The numbers of regions that are tried.
const REGIONS: [usize; 4] = [16, 32, 64, 128];
/// Samples on which they are tried at most.
const TRIED_ON: usize = 16_000;
/// More regions must lower the error by this share.
const WORTH_REGIONS: f64 = 0.005;

/// The regression and what it predicts for samples whose fold is held out.
pub(super) fn regression(
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
                    &[0..3],
                    &[PILOT_RIDGE],
                    std::slice::from_ref(&everywhere),
                )?
                .remove(0);
                let score = log_error(&some, &fitted.held_out, rows.outputs);
                if score < best.0 - WORTH_REGIONS {
                    best = (score, regions);
                }
                // No more regions than samples that differ.
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

/// Mean logarithm of the distance of predicted ends: early and late samples count alike.
fn log_error(samples: &[TrainingSample], held_out: &[f64], outputs: usize) -> f64 {
    let (mut sum, mut total) = (0.0, f64::MIN_POSITIVE);
    for (s, predicted) in samples.iter().zip(held_out.chunks_exact(outputs)) {
        let miss_m = s.now_m + DVec3::from_slice(&predicted[..3]) - s.end_m;
        sum += s.weight * 0.5 * (miss_m.length_squared() + LEAST_ERROR_M * LEAST_ERROR_M).ln();
        total += s.weight;
    }
    sum / total
}

/// Smaller errors are as good as this one where errors are compared, m.
const LEAST_ERROR_M: f64 = 2e-3;

/// Regions of progress over samples.
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
