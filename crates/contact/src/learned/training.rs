//! From labelled reaches to what a regression is fitted to.

use crate::error::ContactError;
use crate::gates::Gates;
use crate::held_out_errors::{SENSOR_M, weighted_quantile};
use crate::learned::LearnedConfig;
use crate::local_ridge::{Fitted, LocalRidge, Rows};
use crate::primitive::{Follower, Primitive, Training};
use crate::reach_track::{Inputs, PROGRESS, ReachTrack};
use glam::DVec3;
use hwall_bip::Demonstration;
use hwall_hand::LabelledReach;

/// Way left, time left, normal.
pub(crate) const OUTPUTS: usize = 7;
/// Parts that primitives are held out in: a primitive changes little with a fifth of its reaches, and
/// training it takes longer than training a regression.
const PRIMITIVE_PARTS: usize = 5;
/// Candidates for the ridge, as shares of the mean squared length of a row.
const RIDGES: [f64; 8] = [1e-4, 1e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 10.0];
/// The one with which the usual error of a region is found out.
const PILOT_RIDGE: f64 = 3e-2;
/// More points of the hand must better the primitive by this share: they cost time in every step.
const WORTH: f64 = 0.05;

/// One sample of a reach that is learnt from.
#[derive(Debug, Clone)]
pub(crate) struct Sampled {
    fold: usize,
    /// All samples of a reach together have the weight 1.
    pub(crate) weight: f64,
    progress: [f64; PROGRESS],
    features: Vec<f64>,
    pub(crate) start_m: DVec3,
    pub(crate) now_m: DVec3,
    pub(crate) end_m: DVec3,
    pub(crate) left_s: f64,
    normal: Option<DVec3>,
    /// What a primitive said that had not learnt from this fold, m.
    pub(crate) primitive_m: Option<DVec3>,
}

/// Samples at even times of all reaches, without a primitive.
pub(crate) fn samples(
    inputs: &Inputs,
    reaches: &[LabelledReach],
    folds: &[usize],
    config: &LearnedConfig,
) -> Vec<Sampled> {
    let mut samples = Vec::new();
    for (reach, fold) in reaches.iter().zip(folds) {
        let first = samples.len();
        let mut track = ReachTrack::new(inputs);
        let mut due = Due::new(reach, config.samples_per_reach);
        for (k, frame) in reach.frames.iter().enumerate() {
            if !track.push(frame) || !due.at(k, frame.t_s) {
                continue;
            }
            let (Some((t_s, now_m)), Some((_, start_m))) = (track.now(), track.start()) else {
                continue;
            };
            let mut features = Vec::new();
            track.features_into(inputs, &mut features);
            samples.push(Sampled {
                fold: *fold,
                weight: 1.0,
                progress: track.progress(),
                features,
                start_m,
                now_m,
                end_m: reach.contact_m,
                left_s: reach.contact_s - t_s,
                normal: reach.normal,
                primitive_m: None,
            });
        }
        let count = (samples.len() - first) as f64;
        for s in &mut samples[first..] {
            s.weight = 1.0 / count;
        }
    }
    samples
}

/// Which frames of a reach are samples: the first, one whenever another share of the time is over,
/// and the last.
struct Due {
    start_s: f64,
    step_s: f64,
    last: usize,
    next: f64,
}

impl Due {
    fn new(reach: &LabelledReach, count: usize) -> Self {
        Self {
            start_s: reach.frames.first().map_or(0.0, |f| f.t_s),
            step_s: reach.duration_s() / count as f64,
            last: reach.frames.len() - 1,
            next: 0.0,
        }
    }

    fn at(&mut self, frame: usize, t_s: f64) -> bool {
        let due = t_s >= self.start_s + self.next * self.step_s || frame == self.last;
        if due {
            let over = (t_s - self.start_s) / self.step_s;
            // A reach without duration is a single sample.
            self.next = if over.is_finite() {
                over.floor() + 1.0
            } else {
                f64::INFINITY
            };
        }
        due
    }
}

/// Lets primitives say where every sample ends, each trained without the fold it is asked about, and
/// gives back the one trained on all.
///
/// Of the touching point alone and all points of the hand, the cheaper one is taken unless the other
/// is clearly better on what was held out.
pub(crate) fn primitive(
    inputs: &Inputs,
    reaches: &[LabelledReach],
    folds: &[usize],
    samples: &mut [Sampled],
    config: &LearnedConfig,
) -> Result<Primitive, ContactError> {
    let mut best: Option<(f64, Training, Vec<Demonstration>)> = None;
    let mut points = vec![1, inputs.points()];
    points.dedup();
    for points in points {
        let demonstrations: Vec<Demonstration> = reaches
            .iter()
            .map(|r| crate::primitive::demonstration(inputs, points, r))
            .collect::<Result<_, _>>()?;
        let training = Training::tuned(config, points, &demonstrations)?;
        let said = held_out(inputs, reaches, &demonstrations, folds, &training, config)?;
        // Where a primitive is lost it counts as if it said that the hand stays where it is.
        let misses = samples
            .iter()
            .zip(&said)
            .map(|(s, said)| said.unwrap_or(s.now_m).distance(s.end_m));
        let mean = robust_mean(misses.zip(samples.iter().map(|s| s.weight)));
        if best
            .as_ref()
            .is_none_or(|(least, ..)| mean < (1.0 - WORTH) * least)
        {
            for (sample, said) in samples.iter_mut().zip(said) {
                sample.primitive_m = said;
            }
            best = Some((mean, training, demonstrations));
        }
    }
    // There is always a first.
    let Some((_, training, demonstrations)) = best else {
        return Err(ContactError::TooFewReaches { got: 0, needed: 1 });
    };
    training.primitive(reaches.iter().zip(&demonstrations))
}

/// Mean of what lies below four times the median, the rest counting as that.
fn robust_mean(values: impl Iterator<Item = (f64, f64)>) -> f64 {
    let values: Vec<(f64, f64)> = values.collect();
    let limit = 4.0 * weighted_quantile(0.5, values.iter().copied());
    let total: f64 = values.iter().map(|v| v.1).sum();
    values.iter().map(|(x, w)| x.min(limit) * w).sum::<f64>() / total
}

/// What primitives say at every sample of the folds that they were not trained with, m, unless they are
/// lost; in the order of [`samples`].
fn held_out(
    inputs: &Inputs,
    reaches: &[LabelledReach],
    demonstrations: &[Demonstration],
    folds: &[usize],
    training: &Training,
    config: &LearnedConfig,
) -> Result<Vec<Option<DVec3>>, ContactError> {
    let mut said: Vec<Vec<Option<DVec3>>> = vec![Vec::new(); reaches.len()];
    // Whole folds make up a part, so what a primitive is asked about stays unknown to it.
    let part_of = |fold: usize| fold % PRIMITIVE_PARTS;
    let count = 1 + folds.iter().map(|f| part_of(*f)).max().unwrap_or(0);
    for part in 0..count {
        let others = reaches.iter().zip(demonstrations).zip(folds);
        let others = others
            .filter(|(_, f)| part_of(**f) != part)
            .map(|(pair, _)| pair);
        let primitive = training.primitive(others)?;
        let mut follower = Follower::new(&primitive);
        let asked = reaches
            .iter()
            .enumerate()
            .filter(|(i, _)| part_of(folds[*i]) == part);
        for (i, reach) in asked {
            let mut track = ReachTrack::new(inputs);
            let mut due = Due::new(reach, config.samples_per_reach);
            follower.begin();
            for (k, frame) in reach.frames.iter().enumerate() {
                if !track.push(frame) {
                    continue;
                }
                follower.step(inputs, &track)?;
                if due.at(k, frame.t_s) {
                    said[i].push(follower.end()?);
                }
            }
        }
    }
    Ok(said.concat())
}

/// The regression and what it says of samples whose fold is held out.
///
/// The other points of the hand take part only if that is clearly better on what was held out: hands
/// that are held in another way than any that were learnt from misled a regression by centimetres.
pub(crate) fn regression(
    inputs: &Inputs,
    samples: &[Sampled],
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
        let said = fitted.held_out.chunks_exact(rows.outputs);
        let misses = samples.iter().zip(said).map(|(s, said)| {
            let end_m = s.now_m + DVec3::from_slice(&said[..3]);
            end_m.distance(s.end_m)
        });
        // The same weights for both, so that neither chooses what it is judged by.
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
pub(crate) fn gates(samples: &[Sampled], count: usize) -> Gates {
    let progress: Vec<_> = samples.iter().map(|s| s.progress).collect();
    Gates::of(&progress, count)
}

fn rows(samples: &[Sampled], width: usize, gates: &Gates, normals: bool) -> Rows {
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

/// Weights samples by one over the squared error that is usual in their region: otherwise the first,
/// uncertain ones decide the shared coefficients and the last, nearly certain ones pay for it.
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

/// Means of a number of every row by region.
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
