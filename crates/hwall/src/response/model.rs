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

/// How a response is learnt.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseConfig {
    /// Functions of the phase for each coordinate of the hand. Default: 7 Legendre polynomials.
    pub hand: Basis,
    /// The same for each joint. Default: 7 Legendre polynomials.
    pub joints: Basis,
    /// Directions that are kept of each component. Default 22, which with the phase and its velocity fill three wide vectors; the
    /// time of a step grows with the square.
    pub rank: usize,
    /// So many demonstrations make a component on average. Default 25: fewer are more local and know fewer people.
    pub per_component: usize,
    /// Components of fewer demonstrations are none. Default 12.
    pub least: usize,
    /// Standard deviation of each coordinate of a sample from what the demonstrations allow, m. Default 0.1. It is the same for all
    /// components, which are weighed against each other by it, and larger than the noise of a tracker: a new person deviates in
    /// the same direction for many samples, each of which counts as new evidence.
    pub noise_m: f64,
    /// Hypotheses of the bank after the first tenth of a motion, in which there are two for each component. Default 12.
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

/// Within a sampling period the phase velocity changes by this share of its mean.
const VELOCITY_CHANGE: f64 = 0.02;
/// One demonstration in so many is held out to learn how much a reach of somebody else deviates from what is known.
const OTHERS: usize = 4;
/// Demonstrations of a component that are held out for the noise.
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
    /// Learns from demonstrations, in the base frame of the arm. Those points of the hand count that were seen in all of them.
    ///
    /// The last quarter for each task is held out once, to learn how much reaches deviate from a mixture that does not know them
    /// ([`ResponseFilter::is_familiar`](super::ResponseFilter::is_familiar)); from fewer than four dozen nothing is learnt of that.
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
            // The last ones, because demonstrations of one person stand together: others are other people.
            let (known, other) = of_task.split_at(of_task.len() - of_task.len() / OTHERS);
            rest.extend_from_slice(known);
            others.extend_from_slice(other);
        }
        // Of the same points: the evidence is that of these values. Too few to make a model of the rest are too few for this.
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

    /// Learns from demonstrations that were checked and see all `points`, without holding out any.
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
            // Small groups say where they are, all together how people differ.
            false => Covariance::Shared,
        };
        let mixture = Mixture::train(&primitives, &training, &labels, covariance)?;
        positive("noise_m", config.noise_m)?;
        let usual = BankConfig::default();
        let bank = mixture.bank(&BankConfig {
            hypotheses: config.hypotheses,
            // A reach is given from its true start, also when the hand turned to it on its way.
            under_way: 0.0,
            filter: FilterConfig {
                acceleration_variance: Some(acceleration_variance(&mixture)),
                ..usual.filter.clone()
            },
            ..usual
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

    /// Points of the hand that it learnt from.
    #[must_use]
    pub fn points(&self) -> &[HandPoint] {
        &self.points
    }

    /// The components, with their probabilities and demonstrations.
    #[must_use]
    pub const fn mixture(&self) -> &Mixture {
        &self.mixture
    }

    /// Of each coordinate of a sample, m².
    pub(super) const fn variance_m2(&self) -> f64 {
        self.variance_m2
    }

    /// What is usual for reaches of others; `None` where too few were demonstrated.
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
