//! Noise, variation of the phase velocity and correlation time, chosen for the best prediction of held-out motions.
//!
//! A person deviates from the demonstrations in the same direction for many samples, but the filter counts every sample as new evidence. Larger
//! noise compensates for that, and only unseen motions can show by how much.

use super::evaluation::{AllButOne, Evaluation, EvaluationConfig, follow};
use super::map_indexed;
use crate::error::BipError;
use crate::filter::{Filter, FilterConfig, NoiseSource};
use crate::model::{Model, ModelParts, Tuning};
use crate::train::{Demonstration, HELD_OUT, TrainingConfig};
use hwall_numeric::check;

/// Settings of [`tune`].
#[derive(Debug, Clone, PartialEq)]
pub struct TuningConfig {
    /// Factors on the variance of the held-out noise, increasing. Default 1, 2, 4 ... 1024.
    pub noise_factors: Vec<f64>,
    /// Changes of the phase velocity within one sampling period, as shares of its mean,
    /// increasing. Default 0.003, 0.01, 0.03, 0.1.
    pub velocity_changes: Vec<f64>,
    /// Observed and evaluated quantities.
    pub evaluation: EvaluationConfig,
    /// Demonstrations to hold out one at a time, spread evenly. Default 48.
    pub folds: usize,
    /// Correlation times of deviations, as multiples of the sampling period, increasing; 0 means independent from sample to sample; it makes a step
    /// a third faster and is the only choice for an [ensemble](crate::ensemble::EnsembleFilter). Default 0, 3, 10, 30, 100.
    pub correlation_times: Vec<f64>,
    /// Parameters that are not tuned, such as the variance of the phase at the start.
    pub filter: FilterConfig,
}

impl TuningConfig {
    /// Defaults for these groups.
    #[must_use]
    pub fn new(training: &TrainingConfig) -> Self {
        Self {
            noise_factors: (0..11).map(|k| f64::from(1 << k)).collect(),
            velocity_changes: vec![0.003, 0.01, 0.03, 0.1],
            evaluation: EvaluationConfig::new(training),
            folds: 48,
            correlation_times: vec![0.0, 3.0, 10.0, 30.0, 100.0],
            filter: FilterConfig::default(),
        }
    }

    /// Rejects empty lists and settings outside their ranges.
    fn validate(&self) -> Result<(), BipError> {
        let counts = [
            self.noise_factors.len(),
            self.velocity_changes.len(),
            self.correlation_times.len(),
            self.folds,
        ];
        for count in counts {
            check::that(count > 0, "settings to try", count as f64, "at least 1")?;
        }
        for v in self.noise_factors.iter().chain(&self.velocity_changes) {
            check::positive("setting to try", *v)?;
        }
        for v in &self.correlation_times {
            check::non_negative("correlation time", *v)?;
        }
        Ok(self.evaluation.validate()?)
    }
}

/// One setting that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// The setting.
    pub tuning: Tuning,
    /// Mean log score of the ends of the held-out motions, with the spread; larger is better.
    pub log_score: f64,
    /// Coverage of the 90 % intervals without the spread.
    pub coverage_90: f64,
}

/// A tuned model.
#[derive(Debug, Clone, PartialEq)]
pub struct Tuned {
    /// The model of all demonstrations, with the best setting.
    pub model: Model,
    /// Every setting that was tried, in the order of the trials.
    pub trials: Vec<Trial>,
}

/// Trains a model and chooses noise factor, acceleration variance and correlation time by the
/// leave-one-out log score of the end of the motion.
///
/// The search varies the noise with the second of the velocity changes, then the velocity changes, then the noise again, and finally the noise for
/// each further correlation time.
///
/// # Errors
/// Fewer than three demonstrations, empty or bad lists, errors of training or filtering.
pub fn tune(
    demonstrations: &[Demonstration],
    training: &TrainingConfig,
    config: &TuningConfig,
) -> Result<Tuned, BipError> {
    let n = demonstrations.len();
    if n < 3 {
        return Err(BipError::TooFewDemonstrations { needed: 3, got: n });
    }
    config.validate()?;
    let (demonstrations, training) = training.trimmed(demonstrations)?;
    let (demonstrations, training) = (&demonstrations[..], &training);
    let held_out = match training.held_out {
        0 => HELD_OUT,
        count => count,
    };
    let held_out = TrainingConfig {
        held_out,
        ..training.clone()
    };
    let model = Model::train(demonstrations, &held_out)?;
    let folds = Folds::new(demonstrations, training, config, &model)?;
    let scored = moving(demonstrations, &config.evaluation.scored);
    let times = &config.correlation_times;
    let mut trials: Vec<Trial> = Vec::new();
    let mut search = |noise: usize, change: usize, time: usize| -> Result<f64, BipError> {
        let change = config.velocity_changes[change];
        let velocity = model.phase_velocity().mean / model.sampling_period();
        let tuning = Tuning {
            noise_factor: config.noise_factors[noise],
            acceleration_variance: (change * velocity).powi(2),
            spread: 1.0,
            time_spread: 1.0,
            correlation_time: times[time] * model.sampling_period(),
        };
        let same = |t: &&Trial| {
            t.tuning.noise_factor == tuning.noise_factor
                && t.tuning.acceleration_variance == tuning.acceleration_variance
                && t.tuning.correlation_time == tuning.correlation_time
        };
        if let Some(known) = trials.iter().find(same) {
            return Ok(known.log_score);
        }
        let mut evaluation = folds.evaluate(tuning)?;
        let coverage_90 = evaluation.coverage(&scored, 0.9);
        let spread = evaluation.spread(&scored, 0.9).filter(|s| *s > 0.0);
        let spread = spread.unwrap_or(1.0);
        let time_spread = evaluation.time_spread(0.9).filter(|s| *s > 0.0);
        let time_spread = time_spread.unwrap_or(1.0);
        for p in &mut evaluation.predictions {
            p.sd.iter_mut().for_each(|sd| *sd *= spread);
        }
        let trial = Trial {
            tuning: Tuning {
                spread,
                time_spread,
                ..tuning
            },
            log_score: match evaluation.log_score(&scored) {
                score if score.is_nan() => f64::NEG_INFINITY,
                score => score,
            },
            coverage_90,
        };
        let score = trial.log_score;
        trials.push(trial);
        Ok(score)
    };
    let start = 1.min(config.velocity_changes.len() - 1);
    // Every third factor first, because the score may have several maxima along the noise.
    let mut coarse = (0, f64::NEG_INFINITY);
    for i in (0..config.noise_factors.len()).step_by(3) {
        let score = search(i, start, 0)?;
        if score > coarse.1 {
            coarse = (i, score);
        }
    }
    let factors = config.noise_factors.len();
    let noise = climb(factors, coarse.0, |i| search(i, start, 0))?;
    let changes = config.velocity_changes.len();
    let change = climb(changes, start, |i| search(noise, i, 0))?;
    let mut noise = climb(factors, noise, |i| search(i, change, 0))?;
    for time in 1..times.len() {
        noise = climb(factors, noise, |i| search(i, change, time))?;
    }
    let best = trials
        .iter()
        .max_by(|a, b| a.log_score.total_cmp(&b.log_score))
        .map(|t| t.tuning);
    let model = match best {
        Some(tuning) => model.with_tuning(tuning)?,
        None => model,
    };
    Ok(Tuned { model, trials })
}

/// Indices of the degrees of freedom that move, or of all if none moves. Constant ones would be predicted without error and make the intervals of
/// the others look too wide.
fn moving(demonstrations: &[Demonstration], scored: &[usize]) -> Vec<usize> {
    let moves = |dof: usize| {
        let values = demonstrations
            .iter()
            .flat_map(|d| (0..d.len()).filter_map(move |k| d.sample(k).get(dof)));
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(*x), high.max(*x))
        });
        high - low > 1e-9 * low.abs().max(high.abs())
    };
    let places: Vec<usize> = (0..scored.len()).filter(|i| moves(scored[*i])).collect();
    if places.is_empty() {
        (0..scored.len()).collect()
    } else {
        places
    }
}

/// Index of the highest value of a unimodal list, by hill climbing.
fn climb(
    count: usize,
    start: usize,
    mut value: impl FnMut(usize) -> Result<f64, BipError>,
) -> Result<usize, BipError> {
    let (mut at, mut best) = (start, value(start)?);
    for step in [1, -1_isize] {
        let before = at;
        while let Some(next) = at.checked_add_signed(step).filter(|i| *i < count) {
            let here = value(next)?;
            if here <= best {
                break;
            }
            (at, best) = (next, here);
        }
        if at != before {
            break;
        }
    }
    Ok(at)
}

/// The models of all folds, trained once.
struct Folds<'a> {
    demonstrations: &'a [Demonstration],
    config: &'a TuningConfig,
    folds: Vec<Fold>,
}

/// A model of all demonstrations but one.
struct Fold {
    left_out: usize,
    model: Model,
}

impl<'a> Folds<'a> {
    fn new(
        demonstrations: &'a [Demonstration],
        training: &TrainingConfig,
        config: &'a TuningConfig,
        all: &Model,
    ) -> Result<Self, BipError> {
        let n = demonstrations.len();
        let folds = config.folds.min(n);
        let quick = TrainingConfig {
            held_out: 0,
            ..training.clone()
        };
        let all_but_one = AllButOne::new(demonstrations, &quick)?;
        let models = map_indexed(folds, |f| {
            let left_out = f * n / folds;
            let model = all_but_one.model(left_out)?;
            // The noise is one number per degree of freedom. The motion left out contributes one part in n to it, which is negligible, and keeping
            // it saves n² fits.
            let model = Model::from_parts(ModelParts {
                noise_held_out: all.parts().noise_held_out.clone(),
                ..model.parts().clone()
            });
            Ok(Fold { left_out, model })
        });
        Ok(Self {
            demonstrations,
            config,
            folds: models.into_iter().collect::<Result<_, BipError>>()?,
        })
    }

    fn evaluate(&self, tuning: Tuning) -> Result<Evaluation, BipError> {
        let filter = FilterConfig {
            noise: NoiseSource::HeldOut,
            noise_factor: Some(tuning.noise_factor),
            acceleration_variance: Some(tuning.acceleration_variance),
            correlation_time: Some(tuning.correlation_time),
            ..self.config.filter.clone()
        };
        let folds = map_indexed(self.folds.len(), |f| {
            let Fold { left_out, model } = &self.folds[f];
            follow(
                &mut Filter::new(model, &filter)?,
                *left_out,
                &self.demonstrations[*left_out],
                &self.config.evaluation,
            )
        });
        Evaluation::of_folds(folds)
    }
}
