//! Predictions of a bank: moments of the mixture of its hypotheses.

use super::filter_bank::Bank;
use super::hypothesis::{Hypothesis, Mode};
use crate::error::{BipError, length};
use crate::filter::{Filter, TimeToEnd};
use hwall_numeric::check;

/// Longest time to the end that counts, in motions of average duration.
const LONGEST: f64 = 5.0;

impl Bank {
    /// Probability that the hand rests.
    #[must_use]
    pub fn resting(&self) -> f64 {
        self.average(|h| if h.mode == Mode::Resting { 1.0 } else { 0.0 })
    }

    /// Probability of a component of the prior; 0 if there is no such component.
    #[must_use]
    pub fn component_probability(&self, component: usize) -> f64 {
        self.average(|h| if h.component == component { 1.0 } else { 0.0 })
    }

    /// Mean of the phase.
    #[must_use]
    pub fn phase(&self) -> f64 {
        self.average(|h| h.posterior.phase())
    }

    /// Mean of the phase velocity, 1/time; a resting hand has velocity 0.
    #[must_use]
    pub fn phase_velocity(&self) -> f64 {
        self.average(Hypothesis::velocity)
    }

    fn average(&self, value: impl Fn(&Hypothesis) -> f64) -> f64 {
        let values = self.hypotheses.list.iter();
        values.map(|h| h.weight * value(h)).sum()
    }

    /// Covariance of phase and phase velocity.
    #[must_use]
    pub fn phase_covariance(&mut self) -> [[f64; 2]; 2] {
        let centre = [self.phase(), self.phase_velocity()];
        let mut sum = [[0.0; 2]; 2];
        for h in &mut self.hypotheses.list {
            let away = [h.posterior.phase() - centre[0], h.velocity() - centre[1]];
            let component = &mut self.components[h.component];
            let mut within = component.with(&mut h.posterior, |f| f.phase_covariance());
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
        self.mix(
            |_| true,
            dofs,
            mean,
            variance,
            false,
            |filter, mean, variance| filter.moments_at(phase, dofs, mean, variance),
        )
    }

    /// Mean and variance of a measurement at a phase; see [`Filter::predict_at`].
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
        self.mix(
            |_| true,
            dofs,
            mean,
            variance,
            false,
            |filter, mean, variance| filter.predict_at(phase, dofs, mean, variance),
        )
    }

    /// Mean and covariance (row-major) of some degrees of freedom at a phase, over the hypotheses of one component; returns `false` without writing
    /// if no such hypothesis is left. Use it if components are mutually exclusive motions, e.g. configurations of an arm on different branches,
    /// because the overall mean of such motions is not a possible motion.
    ///
    /// # Errors
    /// As [`Filter::covariance_at`].
    pub fn component_covariance_at(
        &mut self,
        component: usize,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        covariance: &mut [f64],
    ) -> Result<bool, BipError> {
        let counts = |h: &Hypothesis| h.component == component && h.weight > 0.0;
        if !self.hypotheses.list.iter().any(counts) {
            return Ok(false);
        }
        self.mix(
            counts,
            dofs,
            mean,
            covariance,
            true,
            |filter, mean, covariance| filter.covariance_at(phase, dofs, mean, covariance),
        )?;
        Ok(true)
    }

    /// Moments of the mixture of the hypotheses that `counts` accepts, from the moments that `each` computes for one of them.
    fn mix(
        &mut self,
        counts: impl Fn(&Hypothesis) -> bool,
        dofs: &[usize],
        mean: &mut [f64],
        second: &mut [f64],
        full: bool,
        mut each: impl FnMut(&mut Filter, &mut [f64], &mut [f64]) -> Result<(), BipError>,
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
                expected: self.components[0].filter.dofs(),
                got: m,
            });
        }
        mean.fill(0.0);
        second.fill(0.0);
        let [part, part_second] = &mut self.moments;
        let (part, part_second) = (&mut part[..m], &mut part_second[..second.len()]);
        // Shifted by the mean so far, so that nothing cancels (West's algorithm for variances).
        let mut weight = 0.0;
        for h in self.hypotheses.list.iter_mut().filter(|h| counts(h)) {
            self.components[h.component].with(&mut h.posterior, |f| each(f, part, part_second))?;
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
        check::all_finite("mean", mean)?;
        Ok(check::all_finite("variance", second)?)
    }

    /// Time left until phase 1. A hand at rest, or slowing down or gathering speed, is expected to rest for the average pause and to continue at
    /// the average velocity. `None` unless hypotheses with more than half of the probability predict the end.
    #[must_use]
    pub fn time_to_end(&mut self) -> Option<TimeToEnd> {
        let (mut weight, mut mean, mut variance) = (0.0, 0.0, 0.0);
        for h in &mut self.hypotheses.list {
            let component = &mut self.components[h.component];
            let nominal = component.velocity;
            let left = match h.mode {
                // For very small velocities the quotient is meaningless.
                Mode::Moving => component
                    .with(&mut h.posterior, |f| f.time_to_end())
                    .filter(|t| t.mean.max(t.sd) * nominal.mean < LONGEST),
                Mode::Resting | Mode::ChangingSpeed if nominal.mean > 0.0 => {
                    let going = (1.0 - h.posterior.phase()).max(0.0) / nominal.mean;
                    let pause = self.config.pause_length / nominal.mean;
                    // The rest of a pause is exponential: its standard deviation is its mean.
                    let sd = (going * nominal.variance.sqrt() / nominal.mean).hypot(pause);
                    Some(TimeToEnd {
                        mean: pause + going,
                        sd,
                    })
                }
                Mode::Resting | Mode::ChangingSpeed => None,
            };
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
