//! A simulated participant.

use super::roughness::Roughness;
use crate::error::StudyError;
use crate::present::{Presentation, round};
use crate::protocol::{PlannedTrial, Procedure};
use hwall::numeric::check::{non_negative, that};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Variation between and within participants; standard deviations of natural logarithms.
#[derive(Debug, Clone, PartialEq)]
pub struct ParticipantConfig {
    /// Roughness for the mean participant.
    pub roughness: Roughness,
    /// Between participants: the answer to the same roughness. Default 0.6.
    pub modulus_sd: f64,
    /// Between participants: sensitivity to changes of roughness, relative. Default 0.15.
    pub sensitivity_sd: f64,
    /// From trial to trial. Default 0.25.
    pub noise_sd: f64,
    /// Share of trials with an answer independent of the touch. Default 0.01.
    pub lapse_rate: f64,
    /// Relative growth of the noise over 100 trials. Default 0.1.
    pub fatigue_per_100: f64,
    /// For studies with a scale: mean ratings of the conditions, in order and repeated cyclically, independent of the touch, before
    /// rounding to a point of the scale. Empty, the default: ratings follow the roughness.
    pub ratings: Vec<f64>,
    /// How much more real a presented wall feels than a whiteboard, points of a scale. Default 0.
    pub more_real: f64,
    /// Between participants and again from trial to trial: those ratings and answers, points of a scale. Default 0.5.
    pub rating_sd: f64,
}

impl Default for ParticipantConfig {
    fn default() -> Self {
        Self {
            roughness: Roughness::default(),
            modulus_sd: 0.6,
            sensitivity_sd: 0.15,
            noise_sd: 0.25,
            lapse_rate: 0.01,
            fatigue_per_100: 0.1,
            ratings: Vec::new(),
            more_real: 0.0,
            rating_sd: 0.5,
        }
    }
}

impl ParticipantConfig {
    /// Rejects negative deviations and rates above one.
    ///
    /// # Errors
    /// The first such number.
    pub fn validate(&self) -> Result<(), StudyError> {
        self.roughness.validate()?;
        for (what, value) in [
            ("modulus_sd", self.modulus_sd),
            ("sensitivity_sd", self.sensitivity_sd),
            ("noise_sd", self.noise_sd),
            ("fatigue_per_100", self.fatigue_per_100),
            ("rating_sd", self.rating_sd),
        ] {
            non_negative(what, value)?;
            that(value <= 10.0, what, value, "at most 10")?;
        }
        let planted = self.ratings.iter().chain([&self.more_real]);
        for value in planted {
            that(
                value.abs() <= 100.0,
                "ratings, more_real",
                *value,
                "within 100 of zero",
            )?;
        }
        let rate = self.lapse_rate;
        that((0.0..=1.0).contains(&rate), "lapse_rate", rate, "0 to 1")?;
        Ok(())
    }
}

/// A simulated participant with its own modulus and sensitivity.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedParticipant {
    config: ParticipantConfig,
    ln_modulus: f64,
    sensitivity: f64,
    /// Deviation of its ratings, standard deviations.
    rates_off: f64,
    seed: u64,
}

/// Answer of the mean participant to a roughness with logarithm zero.
const NOMINAL_ANSWER: f64 = 5.0;
/// Smallest and largest answer.
const SAID: [f64; 2] = [1e-3, 1e8];
/// Logarithm at the middle of a rating scale, and its distance to the ends.
const SCALE_MIDDLE: f64 = 0.45;
const SCALE_HALF: f64 = 0.75;

impl SimulatedParticipant {
    /// Participant `number`, from 0; equal seeds give equal participants.
    ///
    /// # Errors
    /// As [`ParticipantConfig::validate`].
    pub fn new(config: &ParticipantConfig, seed: u64, number: usize) -> Result<Self, StudyError> {
        config.validate()?;
        let own = seed ^ (number as u64 + 1).wrapping_mul(0xa076_1d64_78bd_642f);
        let mut numbers = Pcg64::seed_from_u64(own);
        let mut normal = || -> f64 { StandardNormal.sample(&mut numbers) };
        Ok(Self {
            ln_modulus: NOMINAL_ANSWER.ln() + config.modulus_sd * normal(),
            sensitivity: (1.0 + config.sensitivity_sd * normal()).max(0.0),
            rates_off: normal(),
            config: config.clone(),
            seed: own,
        })
    }

    /// The answer to a trial, and its response time, s; `None` for a presentation that was not felt.
    ///
    /// Depends only on the participant, the trial's number and the rendered stimulus, so a study resumed after a crash
    /// gets the same answers.
    #[must_use]
    pub fn answer(
        &self,
        procedure: Procedure,
        trial: &PlannedTrial,
        shown: &Presentation,
    ) -> Option<(f64, f64)> {
        let step = (trial.number as u64).wrapping_mul(0xe703_7ed1_a0b4_28db);
        let mut numbers = Pcg64::seed_from_u64(self.seed.rotate_left(29) ^ step);
        let tired = 1.0 + self.config.fatigue_per_100 * 0.01 * trial.number as f64;
        let lapse = numbers.random_bool(self.config.lapse_rate);
        let luck: f64 = numbers.random_range(0.0..1.0);
        let mut normal = || -> f64 { StandardNormal.sample(&mut numbers) };
        if let Some(rating) = self.planted_rating(procedure, trial) {
            shown.rendered.force_n?;
            let points = procedure.points()?;
            let last = f64::from(points) - 1.0;
            let off = self.config.rating_sd * (self.rates_off + normal() * tired);
            let rating = if lapse {
                1.0 + luck * last
            } else {
                rating + off
            };
            let rating = rating.round().clamp(1.0, last + 1.0);
            let slow = (0.3 * normal()).clamp(-2.0, 2.0);
            let compares = procedure.is_two_intervals();
            // High ratings favour the condition, high answers the second touch.
            let answer = match compares && !trial.second {
                true => last + 2.0 - rating,
                false => rating,
            };
            return Some((answer, round(1.8 * slow.exp())));
        }
        let mut noise = || normal() * self.config.noise_sd * tired;
        let felt = self.sensitivity * self.config.roughness.felt(&shown.rendered)? + noise();
        let answer = match procedure {
            Procedure::Magnitude => {
                let ln = if lapse { 2.0 * luck - 1.0 } else { felt };
                // People answer with about two digits.
                two_digits((self.ln_modulus + ln).exp().clamp(SAID[0], SAID[1]))
            }
            Procedure::Likert { points } | Procedure::MoreReal { points } => {
                let place = (felt - SCALE_MIDDLE) / SCALE_HALF;
                let place = if lapse { 2.0 * luck - 1.0 } else { place };
                let last = f64::from(points) - 1.0;
                (1.0 + 0.5 * last * (1.0 + place))
                    .round()
                    .clamp(1.0, last + 1.0)
            }
            Procedure::TwoIntervals | Procedure::Staircase | Procedure::Quest => {
                let reference = shown.reference.as_ref();
                let reference = self.config.roughness.felt(reference?)?;
                let rougher = felt > self.sensitivity * reference + noise();
                let condition_first = !trial.second;
                let first = if lapse {
                    luck < 0.5
                } else {
                    rougher == condition_first
                };
                if first { 1.0 } else { 2.0 }
            }
        };
        let slow = (0.3 * noise() / self.config.noise_sd.max(1e-3)).clamp(-2.0, 2.0);
        Some((answer, round(1.8 * slow.exp())))
    }

    /// The mean rating of a condition that does not follow from its roughness.
    fn planted_rating(&self, procedure: Procedure, trial: &PlannedTrial) -> Option<f64> {
        let (planted, more_real) = (&self.config.ratings, self.config.more_real);
        match procedure {
            Procedure::MoreReal { points } => Some(0.5 * (f64::from(points) + 1.0) + more_real),
            Procedure::Likert { .. } => {
                planted.get(trial.condition % planted.len().max(1)).copied()
            }
            _ => None,
        }
    }
}

/// Rounds a positive number to two digits.
fn two_digits(value: f64) -> f64 {
    let digits = 10_f64.powi(1 - value.abs().max(1e-9).log10().floor() as i32);
    round((value * digits).round() / digits)
}
