//! A learned model: regressions of the end, trees and an interaction primitive.

use super::alone;
use super::blend::combination::Blend;
use super::blend::evidence::{Evidence, Witness, near};
use super::blend::places::Places;
use super::blend::sources::{SOURCES, Source, of_combination};
use super::config::{Combination, Frame, LearnedConfig};
use super::estimator::{LearnedEstimator, Learnt, Origin};
use super::held_out::{HeldOutReach, held_out_reaches};
use super::primitive;
use super::quantiles::weighted_quantile;
use super::reaches::reach_track::Inputs;
use super::reaches::samples::{self, TrainingSample};
use super::reaches::speeds::at_another_speed;
use super::regression::local_ridge::Fitted;
use super::regression::training::{self, Regression};
use crate::error::ContactError;
use crate::reach_set::{held_out_groups, references, touching_point};
use glam::DVec3;
use hwall_hand::{HandPoint, LabelledReach};
use std::borrow::Borrow;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Smallest number of training reaches.
const FEWEST: usize = 8;

/// A model learned from labelled reaches: it predicts where a similar reach ends.
///
/// The sources are two ridge regressions, trees that correct the second one, a Bayesian interaction primitive of the hand, and the present
/// position. The regressions predict the remaining displacement, linear in the motion so far, with coefficients that change with the progress of
/// the reach; the first uses the place in the room, the second only the reach. All use the same samples, so their errors are correlated. They are
/// weighted, region by region of progress, by the joint second moments of their errors on held-out people (or reaches, with fewer than three
/// people): [Bar-Shalom 1986], with non-negative weights. The covariance of an estimate is that of the combination, with factors that make 90 %
/// regions contain 90 % of the held-out ends in every region and at every time left. Regions, inputs, ridges and the noise of the primitive are
/// chosen on the same held-out reaches, which makes the factors a little optimistic; with few reaches, the factors are increased to compensate.
///
/// The model contains a smaller fallback model without gaze, if gaze was learned, and that one contains a model of the touching point alone. If a
/// required input has been missing for 0.1 s, the smaller model answers, with a larger covariance, until the input is seen.
#[derive(Debug, Clone)]
pub struct LearnedModel {
    pub(super) learnt: Arc<Learnt>,
    /// The smaller model for reaches in which a required input is missing: all but gaze, or the touching point alone.
    pub(super) alone: Option<Box<LearnedModel>>,
}

impl LearnedModel {
    /// Trains on reaches that are all in one frame.
    ///
    /// # Errors
    /// Fewer than eight reaches, a reach that [`LabelledReach::validate`] refuses or whose touching point differs from the first, a setting out of
    /// range.
    pub fn train<R: Borrow<LabelledReach>>(
        reaches: &[R],
        config: &LearnedConfig,
    ) -> Result<Self, ContactError> {
        Self::train_and_hold_out(reaches, config).map(|(model, _)| model)
    }

    /// As [`train`](Self::train), and also returns the held-out estimates of each reach, in the order of the reaches. Models built on this one
    /// learn from the errors of these estimates, e.g. [`EvidenceModel::fit_streams`](crate::EvidenceModel::fit_streams).
    ///
    /// # Errors
    /// As [`train`](Self::train).
    pub fn train_and_hold_out<R: Borrow<LabelledReach>>(
        reaches: &[R],
        config: &LearnedConfig,
    ) -> Result<(Self, Vec<HeldOutReach>), ContactError> {
        let reaches = &references(reaches)[..];
        config.validate()?;
        if reaches.len() < FEWEST {
            return Err(ContactError::TooFewReaches {
                got: reaches.len(),
                needed: FEWEST,
            });
        }
        touching_point(reaches)?;
        let made = reaches;
        let ends: Vec<DVec3> = made.iter().map(|r| r.contact_m).collect();
        let folds_made = held_out_groups(made, config.folds, config.folds);
        let places = (config.frame != Frame::Start).then(|| Places::of(&ends, &folds_made));
        let copies = config
            .other_speed
            .map(|times| at_another_speed(made, times));
        let copies = references(copies.as_deref().unwrap_or_default());
        let reaches = &[made, &copies].concat()[..];
        // A copy is held out together with its original.
        let folds: Vec<usize> = folds_made
            .iter()
            .cycle()
            .take(reaches.len())
            .copied()
            .collect();
        let inputs = Inputs::of(reaches, config.gaze, config.lags);
        let mut samples = samples::of(&inputs, reaches, &folds, config);
        // A reach and its copy together count as one.
        let share = made.len() as f64 / reaches.len() as f64;
        samples.iter_mut().for_each(|s| s.weight *= share);
        let primitive = match config.combination {
            Combination::Regression => None,
            _ => Some(primitive::training::primitive(
                &inputs,
                reaches,
                &folds,
                &mut samples,
                config,
            )?),
        };
        let normals = reaches.iter().all(|r| r.normal.is_some());
        let Regression {
            gates,
            rows,
            fitted,
            correction,
            corrected_m,
        } = training::regression(&inputs, &samples, config, normals)?;
        let [time_from, normal_from] = [3..4, 4..rows.outputs].map(|columns| {
            let square = |k: usize| -> f64 {
                let of_row = |row: usize| {
                    let at = row * rows.outputs;
                    let miss = |c: usize| fitted[k].held_out[at + c] - rows.wanted[at + c];
                    columns.clone().map(|c| miss(c).powi(2)).sum::<f64>()
                };
                (0..rows.len()).map(of_row).sum()
            };
            usize::from(square(1) < square(0))
        });
        let witnesses: Vec<Witness> = samples
            .iter()
            .enumerate()
            .map(|(row, sample)| {
                let corrected_m = corrected_m[row];
                witness(sample, row, &fitted, corrected_m, time_from, config)
            })
            .collect();
        let people = numbered(reaches);
        let of_samples: Vec<usize> = samples.iter().map(|s| people[s.reach]).collect();
        let evidence = Evidence {
            samples: &samples,
            rows: &rows,
            witnesses: &witnesses,
            places: places.as_ref(),
            people: &of_samples,
            made: made.len(),
            near: near(&samples, &rows),
        };
        let (blend, held_out) = Blend::of(&evidence);
        let held_out = held_out_reaches(&evidence, &blend, &held_out, made);
        let relied_on = relied_on(&inputs, &fitted);
        let [room, start] = fitted;
        let alone = inputs.cues().next().and_then(|_| {
            let (reaches, config) = alone::stripped(made, &inputs, config);
            Some(Box::new(Self::train(&reaches, &config).ok()?))
        });
        let model = Self {
            alone,
            learnt: Arc::new(Learnt {
                origin: origin(made),
                inputs,
                gates,
                ridges: [room.ridge, start.ridge],
                time_from,
                normal_from,
                correction,
                primitive,
                places,
                blend,
                combination: config.combination,
                frame: config.frame,
                relied_on,
            }),
        };
        Ok((model, held_out))
    }

    /// Number of training reaches.
    #[must_use]
    pub fn reaches(&self) -> usize {
        self.learnt.origin.reaches
    }

    /// Number of named people who made the training reaches.
    #[must_use]
    pub fn people(&self) -> usize {
        self.learnt.origin.people
    }

    /// Median duration of the training reaches, s.
    #[must_use]
    pub fn median_duration_s(&self) -> f64 {
        self.learnt.origin.median_duration_s
    }

    /// The point of the hand whose contact is predicted.
    #[must_use]
    pub fn touching_point(&self) -> HandPoint {
        self.learnt.inputs.point
    }

    /// Source of the predicted end.
    #[must_use]
    pub fn combination(&self) -> Combination {
        self.learnt.combination
    }

    /// A new estimator. Estimators share the learned parameters.
    #[must_use]
    pub fn estimator(&self) -> LearnedEstimator {
        LearnedEstimator::new(&self.learnt, self.alone.as_deref().map(Self::estimator))
    }
}

/// A model relies on an input that a regression uses in more than this share of the regions.
const RELIED_ON: f64 = 0.25;

/// Does the model rely on each of the [`cues`](Inputs::cues)?
fn relied_on(inputs: &Inputs, fitted: &[Fitted; 2]) -> Vec<bool> {
    let blocks = inputs.blocks();
    let is_used = |fitted: &Fitted, block: usize| {
        let using = fitted.used.iter().filter(|used| used[block]).count();
        using as f64 > RELIED_ON * fitted.used.len() as f64
    };
    let relies_on = |cue| {
        let mut of_cue = (0..blocks.len()).filter(|block| blocks[*block].kind.cue() == Some(cue));
        of_cue.any(|block| fitted.iter().any(|fitted| is_used(fitted, block)))
    };
    inputs.cues().map(relies_on).collect()
}

fn origin(reaches: &[&LabelledReach]) -> Origin {
    let people: BTreeSet<_> = reaches.iter().filter_map(|r| r.person.as_ref()).collect();
    let durations = reaches.iter().map(|r| (r.duration_s(), 1.0));
    Origin {
        reaches: reaches.len(),
        people: people.len(),
        median_duration_s: weighted_quantile(0.5, durations),
    }
}

/// The held-out estimates of all sources for a sample.
fn witness(
    sample: &TrainingSample,
    row: usize,
    fitted: &[Fitted; 2],
    corrected_m: DVec3,
    time_from: usize,
    config: &LearnedConfig,
) -> Witness {
    let outputs = |k: usize| {
        let count = fitted[k].ridge.outputs();
        &fitted[k].held_out[row * count..][..count]
    };
    let mut ends_m = [None; SOURCES];
    for (k, source) in [Source::Room, Source::Start].into_iter().enumerate() {
        ends_m[source as usize] = Some(sample.now_m + DVec3::from_slice(&outputs(k)[..3]));
    }
    ends_m[Source::Primitive as usize] = sample.primitive_m;
    ends_m[Source::Hold as usize] = Some(sample.now_m);
    ends_m[Source::Trees as usize] = Some(corrected_m);
    Witness {
        ends_m: of_combination(config.combination, config.frame, ends_m),
        left_s: outputs(time_from)[3].max(0.0),
        true_left_s: sample.left_s,
    }
}

/// The person of each reach, by number.
fn numbered(reaches: &[&LabelledReach]) -> Vec<usize> {
    let people: BTreeSet<_> = reaches.iter().map(|r| &r.person).collect();
    let number = |r: &&LabelledReach| people.iter().position(|p| **p == r.person).unwrap_or(0);
    reaches.iter().map(number).collect()
}
