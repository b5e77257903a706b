//! Evaluates how well a filter predicts the end of unseen motions.

use super::map_indexed;
use super::motion_filter::MotionFilter;
use crate::error::BipError;
use crate::filter::{Observation, TimeToEnd};
use crate::model::{Model, Role};
use crate::train::{Demonstration, DemonstrationId, Trainer, TrainingConfig};
use hwall_numeric::{ArgumentError, check};

/// Observed and evaluated quantities.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationConfig {
    /// Shares of the samples at which the end is predicted, in `(0, 1]`, increasing.
    pub fractions: Vec<f64>,
    /// Degrees of freedom that the filter observes.
    pub observed: Vec<usize>,
    /// Degrees of freedom whose last value is predicted.
    pub scored: Vec<usize>,
}

impl EvaluationConfig {
    /// Ten fractions; observes every degree of freedom that is not [`Controlled`](Role::Controlled) and scores all.
    #[must_use]
    pub fn new(training: &TrainingConfig) -> Self {
        let roles: Vec<Role> = training
            .groups
            .iter()
            .flat_map(|g| vec![g.role; g.dofs])
            .collect();
        Self {
            fractions: (1..=10).map(|k| f64::from(k) / 10.0).collect(),
            observed: (0..roles.len())
                .filter(|d| roles[*d] != Role::Controlled)
                .collect(),
            scored: (0..roles.len()).collect(),
        }
    }

    /// Rejects empty lists and fractions out of order.
    pub(super) fn validate(&self) -> Result<(), ArgumentError> {
        for (what, count) in [
            ("fractions", self.fractions.len()),
            ("scored degrees of freedom", self.scored.len()),
        ] {
            check::that(count > 0, what, count as f64, "at least 1")?;
        }
        let mut last = 0.0;
        for &f in &self.fractions {
            let wanted = "increasing, above 0 and at most 1";
            last = check::that(f > last && f <= 1.0, "fraction observed", f, wanted)?;
        }
        Ok(())
    }
}

/// A prediction of the end of one motion after a share of it was observed, with the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct EndPrediction {
    /// Index of the motion.
    pub motion: usize,
    /// Share of the samples observed.
    pub fraction: f64,
    /// Mean of every scored degree of freedom.
    pub mean: Vec<f64>,
    /// Standard deviation of a measurement of each, from shape and residual.
    pub sd: Vec<f64>,
    /// Measurement of the last sample.
    pub actual: Vec<f64>,
    /// Time left until the end, predicted and true; `None` without a prediction.
    pub time: Option<TimePrediction>,
}

/// A prediction of the time until the end, with the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimePrediction {
    /// Prediction, in the unit of the demonstrations.
    pub left: TimeToEnd,
    /// True time left.
    pub actual: f64,
}

impl TimePrediction {
    /// Normalised error: truth minus mean, in standard deviations.
    #[must_use]
    pub fn z(&self) -> f64 {
        (self.actual - self.left.mean) / self.left.sd
    }
}

impl EndPrediction {
    /// Normalised error of a scored degree of freedom (by index in [`EvaluationConfig::scored`]): truth minus mean, in standard deviations.
    #[must_use]
    pub fn z(&self, at: usize) -> f64 {
        (self.actual[at] - self.mean[at]) / self.sd[at]
    }

    /// Euclidean distance between mean and truth over some scored degrees of freedom.
    #[must_use]
    pub fn distance(&self, at: &[usize]) -> f64 {
        at.iter()
            .map(|&i| (self.actual[i] - self.mean[i]).powi(2))
            .sum::<f64>()
            .sqrt()
    }

    /// Does the central interval of this probability contain the truth?
    #[must_use]
    pub fn covered(&self, at: usize, probability: f64) -> bool {
        libm::erf(self.z(at).abs() / std::f64::consts::SQRT_2) <= probability
    }

    /// Log density at the truth; larger is better.
    #[must_use]
    pub fn log_score(&self, at: usize) -> f64 {
        -0.5 * (self.z(at).powi(2) + std::f64::consts::TAU.ln()) - self.sd[at].ln()
    }

    /// Continuous ranked probability score, in the unit of the degree of freedom; smaller is
    /// better. For a prediction without uncertainty it is the absolute error.
    ///
    /// Source: [Gneiting 2007], section 4.2.
    #[must_use]
    pub fn crps(&self, at: usize) -> f64 {
        let z = self.z(at);
        let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
        let within = libm::erf(z / std::f64::consts::SQRT_2);
        self.sd[at] * (z * within + 2.0 * density - 1.0 / std::f64::consts::PI.sqrt())
    }
}

/// All predictions of an evaluation, with averages over them; for one fraction, keep those of [`at`](Self::at).
///
/// The averages take indices `at` among the scored degrees of freedom, and panic if out of range.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evaluation {
    /// By motion, then by fraction.
    pub predictions: Vec<EndPrediction>,
}

impl Evaluation {
    /// Predictions after this share of the motion.
    pub fn at(&self, fraction: f64) -> impl Iterator<Item = &EndPrediction> {
        self.predictions
            .iter()
            .filter(move |p| (p.fraction - fraction).abs() < 1e-9)
    }

    /// Coverage of central intervals of this probability, over some scored degrees of freedom and all fractions and motions; NaN if there are none.
    #[must_use]
    pub fn coverage(&self, at: &[usize], probability: f64) -> f64 {
        self.average(at, |p, i| f64::from(u8::from(p.covered(i, probability))))
    }

    /// Mean log score over some scored degrees of freedom; NaN if there are none.
    #[must_use]
    pub fn log_score(&self, at: &[usize]) -> f64 {
        self.average(at, EndPrediction::log_score)
    }

    /// Mean continuous ranked probability score; NaN if there are none.
    #[must_use]
    pub fn crps(&self, at: &[usize]) -> f64 {
        self.average(at, EndPrediction::crps)
    }

    /// Factor on the standard deviations that would give central intervals of this probability exactly that coverage; larger if many errors are of
    /// equal size; `None` without predictions or for an invalid probability.
    #[must_use]
    pub fn spread(&self, at: &[usize], probability: f64) -> Option<f64> {
        let predictions = self.predictions.iter();
        let distances = predictions.flat_map(|p| at.iter().map(|&i| p.z(i).abs()));
        spread_of(distances.collect(), probability, self.motions())
    }

    /// Factor on the standard deviations of the times to the end, as [`spread`](Self::spread); predictions at the end do not count.
    #[must_use]
    pub fn time_spread(&self, probability: f64) -> Option<f64> {
        let before = self.predictions.iter().filter(|p| p.fraction < 1.0);
        let distances = before.filter_map(|p| p.time.map(|time| time.z().abs()));
        let distances = distances.filter(|z| z.is_finite()).collect();
        spread_of(distances, probability, self.motions())
    }

    pub(super) fn of_folds(
        folds: Vec<Result<Vec<EndPrediction>, BipError>>,
    ) -> Result<Self, BipError> {
        let folds: Vec<_> = folds.into_iter().collect::<Result<_, _>>()?;
        Ok(Self {
            predictions: folds.concat(),
        })
    }

    fn motions(&self) -> usize {
        let same = |a: &EndPrediction, b: &EndPrediction| a.motion == b.motion;
        self.predictions.chunk_by(same).count()
    }

    fn average(&self, at: &[usize], value: impl Fn(&EndPrediction, usize) -> f64) -> f64 {
        let sum: f64 = self
            .predictions
            .iter()
            .flat_map(|p| at.iter().map(move |&i| (p, i)))
            .map(|(p, i)| value(p, i))
            .sum();
        sum / (self.predictions.len() * at.len()) as f64
    }
}

/// Relative difference below which distances are equal up to rounding.
const TIE: f64 = 1e-6;

/// Factor that gives central intervals exactly the coverage `probability` of these distances, in standard deviations.
///
/// Different distances show the spread for the next motion. Equal ones only show its scale: their share counts as a scale estimated from that many
/// motions, with the quantiles of Student's t.
fn spread_of(mut distances: Vec<f64>, probability: f64, motions: usize) -> Option<f64> {
    if !(probability > 0.0 && probability < 1.0) {
        return None;
    }
    distances.sort_unstable_by(f64::total_cmp);
    let below = ((probability * distances.len() as f64).ceil() as usize).max(1) - 1;
    let z = *distances.get(below)?;
    let inside = distances.partition_point(|d| *d < z * (1.0 - TIE));
    let tied = below.saturating_sub(inside) as f64 / below.max(1) as f64;
    // The quantile of the normal distribution, by bisection of the function in `covered`.
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..60 {
        let middle: f64 = 0.5 * (low + high);
        if libm::erf(middle / std::f64::consts::SQRT_2) < probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    let degrees = motions.saturating_sub(1).max(1) as f64;
    Some(z / high * (1.0 + tied * (student_ratio(high, degrees) - 1.0)))
}

/// Ratio of the quantiles of Student's t and the normal distribution, `z`. Error: below 1.3 % for at least two degrees of freedom, at 90 %.
///
/// Source: [Abramowitz 1972], 26.7.5.
fn student_ratio(z: f64, degrees: f64) -> f64 {
    let square = z * z;
    1.0 + (square + 1.0) / (4.0 * degrees)
        + ((5.0 * square + 16.0) * square + 3.0) / (96.0 * degrees.powi(2))
        + (((3.0 * square + 19.0) * square + 17.0) * square - 15.0) / (384.0 * degrees.powi(3))
}

/// Lets a filter follow a motion and predict its end at every fraction.
///
/// The filter must be new. The time step before the first sample is the mean period.
///
/// # Errors
/// Fractions out of order, unknown degrees of freedom, errors of the filter.
pub fn follow(
    filter: &mut impl MotionFilter,
    number: usize,
    motion: &Demonstration,
    config: &EvaluationConfig,
) -> Result<Vec<EndPrediction>, BipError> {
    config.validate()?;
    if let Some(&dof) = config
        .observed
        .iter()
        .chain(&config.scored)
        .find(|d| **d >= motion.dofs())
    {
        let dofs = motion.dofs();
        return Err(BipError::UnknownDof { dof, dofs });
    }
    let samples = motion.len();
    let pick = |k: usize, dofs: &[usize]| -> Vec<f64> {
        dofs.iter().map(|&d| motion.sample(k)[d]).collect()
    };
    let (actual, scored) = (pick(samples - 1, &config.scored), config.scored.len());
    let mut predictions = Vec::with_capacity(config.fractions.len());
    for k in 0..samples {
        let dt = match k {
            0 => motion.duration() / (samples - 1) as f64,
            _ => motion.times()[k] - motion.times()[k - 1],
        };
        filter.predict(dt)?;
        filter.observe(&Observation::new(
            &config.observed,
            &pick(k, &config.observed),
        ))?;
        while let Some(&fraction) = config.fractions.get(predictions.len()) {
            // Rounds up, but tolerates a rounding error of the product.
            let needed = ((fraction * samples as f64) - 1e-9).ceil().max(1.0) as usize;
            if k + 1 < needed {
                break;
            }
            let (mut mean, mut variance) = (vec![0.0; scored], vec![0.0; scored]);
            filter.predict_at(1.0, &config.scored, &mut mean, &mut variance)?;
            let sd: Vec<f64> = variance.iter().map(|v| v.sqrt()).collect();
            check::all_finite("standard deviations", &sd)?;
            let left = motion.times()[samples - 1] - motion.times()[k];
            predictions.push(EndPrediction {
                motion: number,
                fraction,
                mean,
                sd,
                actual: actual.clone(),
                time: filter.time_to_end().map(|predicted| TimePrediction {
                    left: predicted,
                    actual: left,
                }),
            });
        }
    }
    Ok(predictions)
}

/// Leave-one-out cross-validation: a filter trained on all other demonstrations follows each one; with [`TrainingConfig::onset`], the rest before
/// and after the motion is cut from both. With the feature `parallel` it runs on all cores, with the same result.
///
/// # Errors
/// Fewer than two demonstrations, errors of training or filtering.
pub fn leave_one_out<F: MotionFilter>(
    demonstrations: &[Demonstration],
    training: &TrainingConfig,
    config: &EvaluationConfig,
    filter: impl Fn(&Model) -> Result<F, BipError> + Sync,
) -> Result<Evaluation, BipError> {
    let n = demonstrations.len();
    if n < 2 {
        return Err(BipError::TooFewDemonstrations { needed: 2, got: n });
    }
    let (demonstrations, training) = training.trimmed(demonstrations)?;
    let all = AllButOne::new(&demonstrations, &training)?;
    let folds = map_indexed(n, |left_out| {
        follow(
            &mut filter(&all.model(left_out)?)?,
            left_out,
            &demonstrations[left_out],
            config,
        )
    });
    Evaluation::of_folds(folds)
}

/// Models of all demonstrations but one; each demonstration is fitted once.
pub(super) struct AllButOne {
    all: Trainer,
    ids: Vec<DemonstrationId>,
}

impl AllButOne {
    pub(super) fn new(
        demonstrations: &[Demonstration],
        training: &TrainingConfig,
    ) -> Result<Self, BipError> {
        let mut all = Trainer::new(training.clone())?;
        let ids = demonstrations.iter().map(|d| all.add(d));
        Ok(Self {
            ids: ids.collect::<Result<_, _>>()?,
            all,
        })
    }

    pub(super) fn model(&self, left_out: usize) -> Result<Model, BipError> {
        let mut others = self.all.clone();
        others.remove(self.ids[left_out])?;
        others.model()
    }
}
