//! What a bank believes: moments of the mixture, and its hypotheses one by one.

use crate::bank::{Hypothesis, Mode, exchange};
use crate::error::{finite, length};
use crate::{Bank, BipError, Filter, TimeToEnd};

/// One hypothesis as seen from outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HypothesisView {
    /// Probability.
    pub probability: f64,
    /// What the person does.
    pub mode: Mode,
    /// Component of the prior, from 0.
    pub component: usize,
    /// Mean of the phase.
    pub phase: f64,
    /// Mean of the phase velocity, 1/time; while resting, the one before.
    pub phase_velocity: f64,
}

impl Bank {
    /// Hypotheses, in no order; probabilities add up to one.
    pub fn hypotheses(&self) -> impl Iterator<Item = HypothesisView> + '_ {
        self.hypotheses.iter().map(|h| HypothesisView {
            probability: h.weight,
            mode: h.mode,
            component: h.component,
            phase: h.belief.state[0][0],
            phase_velocity: h.belief.state[0][1],
        })
    }

    pub(crate) fn heaviest(&self) -> Option<&Hypothesis> {
        self.hypotheses
            .iter()
            .max_by(|a, b| a.weight.total_cmp(&b.weight))
    }

    /// Probability that the hand rests.
    #[must_use]
    pub fn resting(&self) -> f64 {
        self.average(|h| if h.mode == Mode::Resting { 1.0 } else { 0.0 })
    }

    /// Probability of a component of the prior; 0 if there is no such one.
    #[must_use]
    pub fn component_probability(&self, component: usize) -> f64 {
        self.average(|h| if h.component == component { 1.0 } else { 0.0 })
    }

    /// Mean of the phase.
    #[must_use]
    pub fn phase(&self) -> f64 {
        self.average(|h| h.belief.state[0][0])
    }

    /// Mean of the phase velocity, 1/time; that of a resting hand is 0.
    #[must_use]
    pub fn phase_velocity(&self) -> f64 {
        self.average(velocity)
    }

    fn average(&self, value: impl Fn(&Hypothesis) -> f64) -> f64 {
        self.hypotheses.iter().map(|h| h.weight * value(h)).sum()
    }

    /// Covariance of phase and phase velocity.
    #[must_use]
    pub fn phase_covariance(&mut self) -> [[f64; 2]; 2] {
        let centre = [self.phase(), self.phase_velocity()];
        let mut sum = [[0.0; 2]; 2];
        for h in &mut self.hypotheses {
            let away = [h.belief.state[0][0] - centre[0], velocity(h) - centre[1]];
            let filter = &mut self.filters[h.component];
            exchange(filter, &mut h.belief);
            let mut within = filter.phase_covariance();
            exchange(filter, &mut h.belief);
            if h.mode == Mode::Resting {
                within = [[within[0][0], 0.0], [0.0, 0.0]];
            }
            for i in 0..2 {
                for j in 0..2 {
                    sum[i][j] += h.weight * (within[i][j] + away[i] * away[j]);
                }
            }
        }
        sum
    }

    /// Mean and variance of some degrees of freedom at a phase, over all hypotheses.
    ///
    /// # Errors
    /// As [`Filter::moments_at`].
    pub fn moments_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        self.mix(dofs, mean, variance, false, |filter, _, mean, variance| {
            filter.moments_at(phase, dofs, mean, variance)
        })
    }

    /// Mean and variance of what will be measured at a phase; see [`Filter::predict_at`].
    ///
    /// # Errors
    /// As [`Filter::moments_at`].
    pub fn predict_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        self.mix(dofs, mean, variance, false, |filter, _, mean, variance| {
            filter.predict_at(phase, dofs, mean, variance)
        })
    }

    /// Mean and variance of some degrees of freedom after a time `dt` without further turns: who
    /// rests is taken to rest on.
    ///
    /// # Errors
    /// As [`Filter::moments_after`].
    pub fn moments_after(
        &mut self,
        dt: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        self.mix(
            dofs,
            mean,
            variance,
            false,
            |filter, mode, mean, variance| {
                let dt = if mode == Mode::Moving { dt } else { 0.0 };
                filter.moments_after(dt, dofs, mean, variance)
            },
        )
    }

    /// Mean and covariance (row-major) of some degrees of freedom at a phase.
    ///
    /// # Errors
    /// As [`Filter::covariance_at`].
    pub fn covariance_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        covariance: &mut [f64],
    ) -> Result<(), BipError> {
        self.mix(
            dofs,
            mean,
            covariance,
            true,
            |filter, _, mean, covariance| filter.covariance_at(phase, dofs, mean, covariance),
        )
    }

    /// Moments of a mixture, from those that `each` gives of a hypothesis.
    fn mix(
        &mut self,
        dofs: &[usize],
        mean: &mut [f64],
        second: &mut [f64],
        full: bool,
        mut each: impl FnMut(&mut Filter, Mode, &mut [f64], &mut [f64]) -> Result<(), BipError>,
    ) -> Result<(), BipError> {
        let m = dofs.len();
        length("mean", m, mean.len())?;
        length(
            if full { "covariance" } else { "variance" },
            if full { m * m } else { m },
            second.len(),
        )?;
        if m * m > self.moments[0].len() {
            return Err(BipError::WrongLength {
                what: "dofs",
                expected: self.filters[0].projector.dofs(),
                got: m,
            });
        }
        mean.fill(0.0);
        second.fill(0.0);
        let [part, part_second] = &mut self.moments;
        let (part, part_second) = (&mut part[..m], &mut part_second[..second.len()]);
        // Shifted by the mean so far, so that nothing cancels (West's way of adding up variances).
        let mut weight = 0.0;
        for h in &mut self.hypotheses {
            let filter = &mut self.filters[h.component];
            exchange(filter, &mut h.belief);
            let done = each(filter, h.mode, part, part_second);
            exchange(filter, &mut h.belief);
            done?;
            weight += h.weight;
            let share = h.weight / weight;
            for i in 0..m {
                part[i] -= mean[i];
                mean[i] += share * part[i];
            }
            for i in 0..m {
                for j in if full { 0..m } else { i..i + 1 } {
                    let at = if full { i * m + j } else { i };
                    let between = share * (1.0 - share) * part[i] * part[j];
                    second[at] += share * (part_second[at] - second[at]) + between;
                }
            }
        }
        finite("mean", mean)?;
        finite("variance", second)
    }

    /// Probability that the motion is over after a time `dt` without further turns.
    ///
    /// # Errors
    /// A `dt` that is negative or not finite.
    pub fn probability_ended(&mut self, dt: f64) -> Result<f64, BipError> {
        let mut sum = 0.0;
        for h in &mut self.hypotheses {
            let filter = &mut self.filters[h.component];
            exchange(filter, &mut h.belief);
            let dt = if h.mode == Mode::Moving { dt } else { 0.0 * dt };
            let ended = filter.probability_ended(dt);
            exchange(filter, &mut h.belief);
            sum += h.weight * ended?;
        }
        Ok(sum)
    }

    /// Time left until phase 1. Who rests is expected to rest for the average pause and to go on
    /// at the average velocity. `None` while most of the belief does not move forward.
    #[must_use]
    pub fn time_to_end(&mut self) -> Option<TimeToEnd> {
        let (mut weight, mut mean, mut variance) = (0.0, 0.0, 0.0);
        for h in &mut self.hypotheses {
            let usual = self.velocities[h.component];
            let filter = &mut self.filters[h.component];
            exchange(filter, &mut h.belief);
            let left = match h.mode {
                // One that hardly moves would give no time but a pole.
                Mode::Moving => filter
                    .time_to_end()
                    .filter(|t| t.mean.max(t.sd) * usual.mean < LONGEST),
                Mode::Resting if usual.mean > 0.0 => {
                    let going = (1.0 - filter.phase()).max(0.0) / usual.mean;
                    let pause = self.config.pause_length / usual.mean;
                    // The time left of a pause of random end is exponential: as spread as long.
                    let sd = (going * usual.variance.sqrt() / usual.mean).hypot(pause);
                    Some(TimeToEnd {
                        mean: pause + going,
                        sd,
                    })
                }
                Mode::Resting => None,
            };
            exchange(filter, &mut h.belief);
            if let Some(left) = left {
                weight += h.weight;
                let share = h.weight / weight;
                let away = left.mean - mean;
                mean += share * away;
                variance +=
                    share * (left.sd.powi(2) - variance) + share * (1.0 - share) * away.powi(2);
            }
        }
        let estimate = TimeToEnd {
            mean,
            sd: variance.sqrt(),
        };
        (weight > 0.5 && estimate.mean.is_finite() && estimate.sd.is_finite()).then_some(estimate)
    }
}

/// Motions of average duration beyond which a hypothesis says nothing about the time of the end.
const LONGEST: f64 = 5.0;

fn velocity(h: &Hypothesis) -> f64 {
    match h.mode {
        Mode::Moving => h.belief.state[0][1],
        Mode::Resting => 0.0,
    }
}
