//! What is learnt from demonstrations of hand and joints.

use super::components::components;
use super::demonstration::{ResponseDemonstration, Task};
use super::familiarity::{Familiarity, LEAST};
use crate::error::SessionError;
use hwall_bip::{
    Bank, BankConfig, Basis, Covariance, Demonstration, FilterConfig, Group, Mixture, Model,
    TrainingConfig,
};
use hwall_hand::HandPoint;
use hwall_numeric::check::positive;

/// Settings for learning a response.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseConfig {
    /// Basis functions of the phase for each coordinate of the hand. Default: 7 Legendre polynomials.
    pub hand: Basis,
    /// Basis functions of the phase for each joint. Default: 7 Legendre polynomials.
    pub joints: Basis,
    /// Directions kept for each component. Default 22, which with the phase and its velocity fill three wide vectors; the time of a step
    /// grows with the square of this number.
    pub rank: usize,
    /// Average number of demonstrations for each component. Default 25: with fewer, components are more local but represent fewer people.
    pub per_component: usize,
    /// Components of fewer demonstrations are merged into others. Default 12.
    pub least: usize,
    /// Standard deviation of each coordinate of a sample from the demonstrated range, m. Default 0.1. It is the same for all components, so
    /// that they can be weighed against each other. It is larger than the noise of a tracker, because a new person deviates in the same
    /// direction for many samples, and each of these counts as new evidence.
    pub noise_m: f64,
    /// Hypotheses of the bank after the first tenth of a motion; before, there are two for each component. Default 12.
    pub hypotheses: usize,
}

impl Default for ResponseConfig {
    fn default() -> Self {
        let seven = Basis::Legendre { count: 7 };
        Self {
            hand: seven,
            joints: seven,
            rank: 22,
            per_component: 25,
            least: 12,
            noise_m: 0.1,
            hypotheses: 12,
        }
    }
}

/// Change of the phase velocity within a sampling period, as a share of its mean.
const VELOCITY_CHANGE: f64 = 0.02;
/// One demonstration in this many is held out, to learn how much a reach of another person deviates.
const OTHERS: usize = 4;
/// Demonstrations of a component that are held out to estimate the noise.
const HELD_OUT: usize = 16;

/// A mixture of interaction primitives of hand and joints. Immutable; [`filter`](Self::filter) follows a hand with it.
#[derive(Debug, Clone)]
pub struct ResponseModel {
    mixture: Mixture,
    tasks: Vec<Task>,
    points: Vec<HandPoint>,
    bank: Bank,
    variance_m2: f64,
    familiarity: Option<Familiarity>,
}

impl ResponseModel {
    /// Learns from demonstrations in the base frame of the arm. Uses the points of the hand that were seen in all of them.
    ///
    /// The last quarter for each task is held out once, to learn how much new reaches deviate from the mixture
    /// ([`ResponseFilter::is_familiar`](super::ResponseFilter::is_familiar)); with fewer than four dozen demonstrations there is no such
    /// test.
    ///
    /// # Errors
    /// No demonstration; one that is too short, has NaN in its joints or times that do not increase; no common point of the hand;
    /// settings that a primitive refuses.
    pub fn train(
        demonstrations: &[ResponseDemonstration],
        config: &ResponseConfig,
    ) -> Result<Self, SessionError> {
        for (number, demonstration) in demonstrations.iter().enumerate() {
            demonstration.validate(number)?;
        }
        let all: Vec<&ResponseDemonstration> = demonstrations.iter().collect();
        let points: Vec<HandPoint> = HandPoint::ALL
            .into_iter()
            .filter(|point| all.iter().all(|d| d.sees(*point)))
            .collect();
        if points.is_empty() {
            return Err(SessionError::UnseenHand { count: all.len() });
        }
        let model = Self::of(&all, &points, config)?;
        let (mut rest, mut others) = (Vec::new(), Vec::new());
        for task in Task::ALL {
            let of_task: Vec<_> = all.iter().filter(|d| d.task == task).copied().collect();
            // Take the last ones: demonstrations of one person are consecutive, so the last ones are from other people.
            let (known, other) = of_task.split_at(of_task.len() - of_task.len() / OTHERS);
            rest.extend_from_slice(known);
            others.extend_from_slice(other);
        }
        // Uses the same points, so that the evidence is comparable. If the rest is too small for a model, there is no test.
        let without_others = match others.len() < LEAST {
            true => None,
            false => Self::of(&rest, &points, config).ok(),
        };
        let familiarity = match without_others {
            None => None,
            Some(model) => {
                let mut filter = model.filter();
                let evidence = |other: &&ResponseDemonstration| filter.evidence(&other.frames);
                let reaches: Vec<_> = others.iter().map(evidence).collect::<Result<_, _>>()?;
                Familiarity::of(&reaches)
            }
        };
        Ok(Self {
            familiarity,
            ..model
        })
    }

    /// Learns from validated demonstrations that see all `points`, without holding out any.
    fn of(
        demonstrations: &[&ResponseDemonstration],
        points: &[HandPoint],
        config: &ResponseConfig,
    ) -> Result<Self, SessionError> {
        let primitives: Vec<Demonstration> = demonstrations
            .iter()
            .map(|demonstration| demonstration.to_primitive(points))
            .collect::<Result<_, _>>()?;
        let ends: Vec<(Task, [f64; 7])> = demonstrations
            .iter()
            .map(|demonstration| (demonstration.task, demonstration.presents_with()))
            .collect();
        let (labels, tasks) = components(&ends, config.per_component, config.least);
        let training = TrainingConfig {
            max_rank: Some(config.rank),
            held_out: HELD_OUT,
            ..TrainingConfig::new(vec![
                Group::observed("hand", 3 * points.len(), config.hand),
                Group::controlled("joints", 7, config.joints),
            ])
        };
        let size = |part: usize| labels.iter().filter(|label| **label == part).count();
        let sizes: Vec<usize> = (0..tasks.len()).map(size).collect();
        let covariance = match sizes.iter().all(|size| *size >= config.least.max(2)) {
            true => Covariance::Own,
            // Small groups locate the components; all together show how people differ.
            false => Covariance::Shared,
        };
        let mixture = Mixture::train(&primitives, &training, &labels, covariance)?;
        positive("noise_m", config.noise_m)?;
        let nominal = BankConfig::default();
        let bank = mixture.bank(&BankConfig {
            hypotheses: config.hypotheses,
            // A reach is given from its true start, even if the hand turned to it while under way.
            under_way: 0.0,
            filter: FilterConfig {
                acceleration_variance: Some(acceleration_variance(&mixture)),
                ..nominal.filter.clone()
            },
            ..nominal
        })?;
        Ok(Self {
            mixture,
            tasks,
            points: points.to_vec(),
            bank,
            variance_m2: config.noise_m.powi(2),
            familiarity: None,
        })
    }

    /// The task of each component of the mixture.
    #[must_use]
    pub fn tasks(&self) -> &[Task] {
        &self.tasks
    }

    /// Points of the hand that the model learnt from.
    #[must_use]
    pub fn points(&self) -> &[HandPoint] {
        &self.points
    }

    /// The components, with their probabilities and demonstrations.
    #[must_use]
    pub const fn mixture(&self) -> &Mixture {
        &self.mixture
    }

    /// Variance of each coordinate of a sample, m².
    pub(super) const fn variance_m2(&self) -> f64 {
        self.variance_m2
    }

    /// The test for familiar reaches; `None` if too few were demonstrated.
    pub(super) const fn familiarity(&self) -> Option<&Familiarity> {
        self.familiarity.as_ref()
    }

    pub(super) const fn bank(&self) -> &Bank {
        &self.bank
    }
}

/// Variance of the random acceleration of the phase, 1/s⁴.
fn acceleration_variance(mixture: &Mixture) -> f64 {
    let models = mixture.models();
    let mean =
        |of: &dyn Fn(&Model) -> f64| models.iter().map(of).sum::<f64>() / models.len() as f64;
    let velocity = mean(&|model| model.phase_velocity().mean.abs());
    let period_s = mean(&|model| model.sampling_period());
    (VELOCITY_CHANGE * velocity / period_s).powi(2)
}
