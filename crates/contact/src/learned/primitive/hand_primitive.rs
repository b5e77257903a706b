//! Predicts the end of a reach by an interaction primitive of the hand.

use crate::error::ContactError;
use crate::learned::config::LearnedConfig;
use crate::learned::reaches::reach_track::{Inputs, ReachTrack};
use glam::DVec3;
use hwall_bip::{
    Basis, Demonstration, DemonstrationId, EvaluationConfig, Filter, FilterConfig, Group, Model,
    Observation, Trainer, TrainingConfig, Tuning, TuningConfig, tune,
};
use hwall_hand::{LabelledReach, NamedPoint};

/// Largest number of reaches for tuning the noise, spread evenly over all; more reaches change little and take long.
const TUNED_ON: usize = 60;
/// Number of these reaches that are held out one at a time.
const TUNING_FOLDS: usize = 12;
/// Candidate factors on the variance of the noise, and correlation times of deviations in sampling periods: coarser than the default search, whose
/// last percent is not worth twice the training time.
const NOISE_FACTORS: [f64; 6] = [1.0, 4.0, 16.0, 64.0, 256.0, 1024.0];
const CORRELATION_TIMES: [f64; 3] = [0.0, 10.0, 40.0];
/// Demonstrations held out one at a time for the noise of the model.
const HELD_OUT: usize = 16;
/// Shares of the motion at which tuning evaluates predictions.
const TUNED_AT: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 0.9];
/// A primitive has diverged if its squared Mahalanobis distance per coordinate over recent samples exceeds this. Normally it is about 1 and hardly
/// ever above 3; after divergence it is 30 to 1000.
const LOST: f64 = 10.0;
const POINT: [usize; 3] = [0, 1, 2];

/// A trained primitive, ready to follow reaches.
#[derive(Debug, Clone)]
pub(in crate::learned) struct Primitive {
    pub(in crate::learned) model: Model,
    filter: Filter,
    /// Mean offset of the labelled contact from the last position of the touching point, m.
    pub(in crate::learned) label_offset_m: DVec3,
}

impl Primitive {
    pub(in crate::learned) fn new(
        model: Model,
        label_offset_m: DVec3,
    ) -> Result<Self, ContactError> {
        Ok(Self {
            filter: Filter::new(&model, &FilterConfig::default())?,
            model,
            label_offset_m,
        })
    }
}

/// A reach as the filter sees it: `count` points, the touching one first.
pub(super) fn demonstration(
    inputs: &Inputs,
    count: usize,
    reach: &LabelledReach,
) -> Result<Demonstration, ContactError> {
    let start_s = inputs.start_s(reach);
    let mut track = ReachTrack::new(inputs);
    let (mut times, mut values, mut points) = (Vec::new(), Vec::new(), Vec::new());
    for frame in &reach.frames {
        if track.push(frame)
            && let Some((t_s, _)) = track.now().filter(|now| now.0 >= start_s)
        {
            times.push(t_s - start_s);
            track.points_into(inputs, &mut points);
            values.extend(&points[..3 * count]);
        }
    }
    Ok(Demonstration::from_timestamps(times, 3 * count, values)?)
}

/// Training settings of the primitive.
#[derive(Debug, Clone, Copy)]
pub(super) struct Training {
    basis: Basis,
    rank: usize,
    dofs: usize,
    tuning: Option<Tuning>,
}

impl Training {
    fn config(&self) -> TrainingConfig {
        TrainingConfig {
            held_out: HELD_OUT,
            max_rank: Some(self.rank),
            ..TrainingConfig::new(vec![Group::observed("hand", self.dofs, self.basis)])
        }
    }

    /// Tunes the noise for the best prediction of held-out reaches.
    pub(super) fn tuned(
        config: &LearnedConfig,
        points: usize,
        all: &[Demonstration],
    ) -> Result<Self, ContactError> {
        let untuned = Self {
            basis: config.basis,
            rank: config.rank,
            dofs: 3 * points,
            tuning: None,
        };
        let training = untuned.config();
        let step = all.len().div_ceil(TUNED_ON).max(1);
        let some: Vec<Demonstration> = all.iter().step_by(step).cloned().collect();
        let search = TuningConfig {
            evaluation: EvaluationConfig {
                fractions: TUNED_AT.to_vec(),
                scored: POINT.to_vec(),
                ..EvaluationConfig::new(&training)
            },
            folds: TUNING_FOLDS,
            noise_factors: NOISE_FACTORS.to_vec(),
            correlation_times: CORRELATION_TIMES.to_vec(),
            ..TuningConfig::new(&training)
        };
        let model = tune(&some, &training, &search)?.model;
        Ok(Self {
            tuning: model.tuning(),
            ..untuned
        })
    }

    /// Fits the demonstrations of these reaches.
    pub(super) fn fitted(
        &self,
        reaches: &[&LabelledReach],
        demonstrations: &[Demonstration],
    ) -> Result<FittedReaches, ContactError> {
        let mut trainer = Trainer::new(self.config())?;
        let mut offsets = Vec::with_capacity(reaches.len());
        for (reach, demonstration) in reaches.iter().zip(demonstrations) {
            let id = trainer.add(demonstration)?;
            let last = demonstration.sample(demonstration.len() - 1);
            offsets.push((id, reach.contact_m - DVec3::from_slice(&last[..3])));
        }
        Ok(FittedReaches {
            tuning: self.tuning,
            trainer,
            offsets,
        })
    }
}

/// Reaches with fitted demonstrations, so that primitives of subsets need no new fit.
pub(super) struct FittedReaches {
    tuning: Option<Tuning>,
    trainer: Trainer,
    /// Offset of each labelled contact from the last position of the touching point, m.
    offsets: Vec<(DemonstrationId, DVec3)>,
}

impl FittedReaches {
    /// A primitive of the reaches that are kept; `is_kept` takes their index.
    pub(super) fn primitive(
        &self,
        is_kept: impl Fn(usize) -> bool,
    ) -> Result<Primitive, ContactError> {
        let mut trainer = self.trainer.clone();
        let mut offset_m = DVec3::ZERO;
        for (number, (id, own_m)) in self.offsets.iter().enumerate() {
            match is_kept(number) {
                true => offset_m += own_m,
                false => trainer.remove(*id)?,
            }
        }
        let mut model = trainer.model()?;
        if let Some(tuning) = self.tuning {
            model = model.with_tuning(tuning)?;
        }
        Primitive::new(model, offset_m / trainer.len() as f64)
    }
}

/// A primitive that follows one reach.
#[derive(Debug, Clone)]
pub(in crate::learned) struct PrimitiveRun {
    fresh: Filter,
    filter: Filter,
    period_s: f64,
    label_offset_m: DVec3,
    dofs: Vec<usize>,
    values: Vec<f64>,
    last_s: Option<f64>,
}

impl PrimitiveRun {
    pub(in crate::learned) fn new(primitive: &Primitive) -> Self {
        Self {
            fresh: primitive.filter.clone(),
            filter: primitive.filter.clone(),
            period_s: primitive.model.sampling_period(),
            label_offset_m: primitive.label_offset_m,
            dofs: (0..primitive.model.dofs()).collect(),
            values: Vec::with_capacity(3 * NamedPoint::COUNT),
            last_s: None,
        }
    }

    pub(in crate::learned) fn begin(&mut self) {
        // Copies without allocation; both belong to one model.
        if self.filter.restart_from(&self.fresh).is_err() {
            self.filter.clone_from(&self.fresh);
        }
        self.last_s = None;
    }

    /// Takes the latest sample of a track.
    pub(in crate::learned) fn step(
        &mut self,
        inputs: &Inputs,
        track: &ReachTrack,
    ) -> Result<(), ContactError> {
        let Some((t_s, _)) = track.now() else {
            return Ok(());
        };
        if track.is_at_start() {
            self.filter.restart_from(&self.fresh)?;
            self.last_s = None;
        }
        let dt_s = self.last_s.map_or(self.period_s, |last_s| t_s - last_s);
        self.last_s = Some(t_s);
        self.filter.predict(dt_s)?;
        track.points_into(inputs, &mut self.values);
        self.filter.observe(&Observation::new(
            &self.dofs,
            &self.values[..self.dofs.len()],
        ))?;
        Ok(())
    }

    /// Predicted end of the reach, m; `None` if the latest samples are far from the primitive's expectation: it has diverged and its prediction is
    /// meaningless.
    pub(in crate::learned) fn end(&mut self) -> Result<Option<DVec3>, ContactError> {
        if self.filter.health().recent_distance > LOST {
            return Ok(None);
        }
        let (mut mean, mut variance) = ([0.0; 3], [0.0; 3]);
        self.filter
            .predict_at(1.0, &POINT, &mut mean, &mut variance)?;
        Ok(Some(DVec3::from_array(mean) + self.label_offset_m))
    }
}
