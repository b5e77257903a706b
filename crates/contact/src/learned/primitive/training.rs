//! The primitive and its predictions for held-out reaches.

use super::hand_primitive::{FittedReaches, Primitive, PrimitiveRun, Training, demonstration};
use crate::error::ContactError;
use crate::learned::config::LearnedConfig;
use crate::learned::quantiles::weighted_quantile;
use crate::learned::reaches::reach_track::{Inputs, ReachTrack};
use crate::learned::reaches::samples::{SampleTimes, TrainingSample};
use glam::DVec3;
use hwall_bip::Demonstration;
use hwall_hand::LabelledReach;
use hwall_numeric::parallel;

/// Reaches are held out from primitives in this many parts: a primitive changes little without a fifth of its reaches, and takes longer to train
/// than a regression.
const PRIMITIVE_PARTS: usize = 5;
/// Using all points of the hand must improve the primitive by this share, as they cost time in every step.
const WORTH: f64 = 0.05;

/// Adds the held-out prediction of the primitive to every sample, and returns the primitive trained on all reaches.
///
/// It uses the touching point alone, unless a primitive of all points of the hand is clearly better on held-out reaches.
pub(in crate::learned) fn primitive(
    inputs: &Inputs,
    reaches: &[&LabelledReach],
    folds: &[usize],
    samples: &mut [TrainingSample],
    config: &LearnedConfig,
) -> Result<Primitive, ContactError> {
    let mut best: Option<(f64, FittedReaches)> = None;
    let mut points = vec![1, inputs.points()];
    points.dedup();
    for points in points {
        let demonstrations: Vec<Demonstration> = reaches
            .iter()
            .map(|r| demonstration(inputs, points, r))
            .collect::<Result<_, _>>()?;
        let training = Training::tuned(config, points, &demonstrations)?;
        let fitted = training.fitted(reaches, &demonstrations)?;
        let predicted = held_out(inputs, reaches, &fitted, folds, config)?;
        // A diverged primitive counts as predicting that the hand stays where it is.
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
            best = Some((mean, fitted));
        }
    }
    // The loop runs at least once.
    let Some((_, fitted)) = best else {
        return Err(ContactError::TooFewReaches { got: 0, needed: 1 });
    };
    fitted.primitive(|_| true)
}

/// Mean with values clipped to four times the median; `values` are pairs of value and weight.
fn robust_mean(values: impl Iterator<Item = (f64, f64)>) -> f64 {
    let values: Vec<(f64, f64)> = values.collect();
    let limit = 4.0 * weighted_quantile(0.5, values.iter().copied());
    let total: f64 = values.iter().map(|v| v.1).sum();
    values.iter().map(|(x, w)| x.min(limit) * w).sum::<f64>() / total
}

/// Held-out predictions of the end of every sample's reach, m; `None` where the primitive has diverged. In the order of the samples.
fn held_out(
    inputs: &Inputs,
    reaches: &[&LabelledReach],
    fitted: &FittedReaches,
    folds: &[usize],
    config: &LearnedConfig,
) -> Result<Vec<Option<DVec3>>, ContactError> {
    // A part consists of whole folds, so a primitive is never tested on its training data.
    let part_of = |fold: usize| fold % PRIMITIVE_PARTS;
    let count = 1 + folds.iter().map(|f| part_of(*f)).max().unwrap_or(0);
    let of_part = |part: usize| {
        let primitive = fitted.primitive(|i| part_of(folds[i]) != part)?;
        let mut run = PrimitiveRun::new(&primitive);
        let asked = reaches
            .iter()
            .enumerate()
            .filter(|(i, _)| part_of(folds[*i]) == part);
        let mut predicted = Vec::new();
        for (i, reach) in asked {
            let mut track = ReachTrack::new(inputs);
            let mut due = SampleTimes::new(inputs, reach, config.samples_per_reach);
            let mut ends_m = Vec::new();
            run.begin();
            for (k, frame) in reach.frames.iter().enumerate() {
                if !track.push(frame) {
                    continue;
                }
                run.step(inputs, &track)?;
                if due.is_due(k, frame.t_s) {
                    ends_m.push(run.end()?);
                }
            }
            predicted.push((i, ends_m));
        }
        Ok(predicted)
    };
    let mut all: Vec<Vec<Option<DVec3>>> = vec![Vec::new(); reaches.len()];
    let parts: Vec<Result<Vec<_>, ContactError>> = parallel::map(count, of_part);
    for part in parts {
        for (i, ends_m) in part? {
            all[i] = ends_m;
        }
    }
    Ok(all.concat())
}
