//! What a filter predicts: for now, for any phase, for any later time, for the end.

use super::low_rank::Filter;
use super::noise::Lasting;
use super::posterior::{PHASE_STATES, PhaseEstimate};
use crate::error::{BipError, length};
use hwall_numeric::check;

/// Time left until the motion ends, to first order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeToEnd {
    /// `(1 - phase) / phase velocity`, in the unit of the demonstrations.
    pub mean: f64,
    /// Its standard deviation, by linearisation: too small where the velocity is uncertain, unless the model was
    /// [tuned](crate::judge::tune), which makes up for that.
    pub sd: f64,
}

/// Variances here are those of the trajectory itself, unless stated otherwise; a measurement of it
/// adds the noise of [`noise_variance`](Filter::noise_variance). Queries with variances borrow the
/// filter mutably because they use its scratch; they do not change the estimate.
impl Filter {
    /// Covariance of phase and phase velocity.
    #[must_use]
    pub fn phase_covariance(&mut self) -> [[f64; 2]; 2] {
        let scratch = &mut self.scratch;
        scratch.rows.reset(2);
        for k in 0..2 {
            scratch.rows.clear(k);
            scratch.rows.set(k, k, 1.0);
        }
        self.posterior
            .root
            .solve_transposed(&mut scratch.rows, 0, &mut scratch.column);
        let width = self.posterior.mean.len();
        let [variance, covariance, velocity_variance] =
            [(0, 0), (0, 1), (1, 1)].map(|(i, j)| scratch.rows.dot(i, j, width));
        [[variance, covariance], [covariance, velocity_variance]]
    }

    /// Mean and covariance of phase and phase velocity.
    pub(crate) fn phase_estimate(&mut self) -> PhaseEstimate {
        PhaseEstimate {
            mean: [self.phase(), self.phase_velocity()],
            covariance: self.phase_covariance(),
        }
    }

    /// Mean and variance of some degrees of freedom at a phase: 1 is the end point.
    ///
    /// The phase is taken as given; the uncertainty is that of the shape of the motion.
    ///
    /// # Errors
    /// A phase that is not finite or overflows, an unknown degree of freedom, other lengths.
    pub fn moments_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        check::finite("phase", phase)?;
        self.moments(phase, [0.0, 0.0], 0.0, dofs, mean, variance)
    }

    /// Mean and variance of some degrees of freedom after a time `dt`, the uncertainty of phase
    /// and phase velocity included, to first order.
    ///
    /// The phase reached stays within `[0, 1]`: the motion rests at its end.
    ///
    /// # Errors
    /// As [`moments_at`](Self::moments_at); a `dt` that is negative or not finite.
    pub fn moments_after(
        &mut self,
        dt: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        check::non_negative("dt", dt)?;
        let reached = self.phase() + dt * self.phase_velocity();
        let noise = 0.5 * self.dynamics.acceleration_sd * dt * dt;
        // The motion does not go beyond its ends: the phase varies less by this share.
        let sd = self.phase_sd_after(dt);
        let share = spread_within(-reached / sd, (1.0 - reached) / sd);
        let phase = reached.clamp(0.0, 1.0);
        self.moments(
            phase,
            [share, share * dt],
            share * noise,
            dofs,
            mean,
            variance,
        )
    }

    fn moments(
        &mut self,
        phase: f64,
        phase_row: [f64; 2],
        phase_noise_sd: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        length("mean", dofs.len(), mean.len())?;
        length("variance", dofs.len(), variance.len())?;
        self.known(dofs)?;
        self.projector.set_phase(phase);
        // As many at once as there is scratch for: one degree of freedom may be asked for twice.
        let capacity = self.scratch.rows.capacity();
        let from = if phase_row == [0.0, 0.0] {
            PHASE_STATES
        } else {
            0
        };
        for (dofs, (mean, variance)) in dofs
            .chunks(capacity)
            .zip(mean.chunks_mut(capacity).zip(variance.chunks_mut(capacity)))
        {
            let rows = &mut self.scratch.rows;
            rows.reset(dofs.len());
            for (i, (&d, mean)) in dofs.iter().zip(mean.iter_mut()).enumerate() {
                let predicted = self.projector.row(d, &self.posterior.mean, |t, tile| {
                    *rows.tile_mut(i, t) = tile
                });
                rows.set(i, 0, predicted.slope * phase_row[0]);
                rows.set(i, 1, predicted.slope * phase_row[1]);
                *mean = predicted.value;
                variance[i] = (predicted.slope * phase_noise_sd).powi(2);
            }
            self.posterior
                .root
                .solve_transposed(rows, from, &mut self.scratch.column);
            for (i, variance) in variance.iter_mut().enumerate() {
                *variance += rows.dot(i, i, self.posterior.mean.len());
            }
        }
        check::all_finite("mean", mean)
            .and_then(|()| check::all_finite("variance", variance))
            .map_err(|_| BipError::Overflow { phase })
    }

    /// Mean and variance of what will be measured at a later phase: the mean motion, the part of
    /// the present deviation that lasts until then, and the noise that cannot be predicted.
    ///
    /// # Errors
    /// As [`moments_at`](Self::moments_at).
    pub fn predict_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        check::finite("phase", phase)?;
        length("mean", dofs.len(), mean.len())?;
        length("variance", dofs.len(), variance.len())?;
        self.known(dofs)?;
        let now = [self.phase(), self.phase_velocity()];
        let left = if now[1] > 0.0 {
            ((phase - now[0]) / now[1]).max(0.0)
        } else {
            f64::INFINITY
        };
        let capacity = self.scratch.rows.capacity();
        for (dofs, (mean, variance)) in dofs
            .chunks(capacity)
            .zip(mean.chunks_mut(capacity).zip(variance.chunks_mut(capacity)))
        {
            let rows = &mut self.scratch.rows;
            rows.reset(dofs.len());
            self.projector.set_phase(phase);
            for (i, (&d, mean)) in dofs.iter().zip(mean.iter_mut()).enumerate() {
                let then = self.projector.row(d, &self.posterior.mean, |t, tile| {
                    *rows.tile_mut(i, t) = tile
                });
                *mean = then.value;
            }
            for (i, &d) in dofs.iter().enumerate() {
                variance[i] = self.noise.residual_sd[d].powi(2);
                let lasts = self.noise.correlation_time > 0.0;
                let last = self.posterior.last.of(d).filter(|_| lasts);
                let Some(last) = last else { continue };
                let age = self.posterior.last.travelled_since(&last);
                let time = left + self.posterior.last.time_since(&last);
                let Lasting {
                    share,
                    variance: rest,
                } = self.noise.lasting(d, time);
                self.projector
                    .set_phase(self.dynamics.clipped(now[0] - age * now[1]));
                let rows = &mut self.scratch.rows;
                let old = self.projector.row(d, &self.posterior.mean, |t, tile| {
                    for (h, x) in rows.tile_mut(i, t).iter_mut().zip(tile) {
                        *h -= share * x;
                    }
                });
                rows.set(i, 0, -share * old.slope);
                rows.set(i, 1, share * old.slope * age);
                mean[i] += share * (last.value - old.value);
                variance[i] = rest;
            }
            let rows = &mut self.scratch.rows;
            self.posterior
                .root
                .solve_transposed(rows, 0, &mut self.scratch.column);
            for (i, variance) in variance.iter_mut().enumerate() {
                *variance += rows.dot(i, i, self.posterior.mean.len());
                *variance *= self.noise.spread.powi(2);
            }
        }
        check::all_finite("mean", mean)
            .and_then(|()| check::all_finite("variance", variance))
            .map_err(|_| BipError::Overflow { phase })
    }

    /// Refuses degrees of freedom that the model does not have.
    fn known(&self, dofs: &[usize]) -> Result<(), BipError> {
        let count = self.projector.dofs();
        match dofs.iter().find(|d| **d >= count) {
            None => Ok(()),
            Some(&dof) => Err(BipError::UnknownDof { dof, dofs: count }),
        }
    }

    /// Mean and covariance (row-major) of some degrees of freedom at a given phase, such as the
    /// three coordinates of a contact point at phase 1.
    ///
    /// # Errors
    /// As [`moments_at`](Self::moments_at); more degrees of freedom than the model has.
    pub fn covariance_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        covariance: &mut [f64],
    ) -> Result<(), BipError> {
        check::finite("phase", phase)?;
        let m = dofs.len();
        let count = self.projector.dofs();
        length("mean", m, mean.len())?;
        length("covariance", m * m, covariance.len())?;
        if m > count {
            return Err(BipError::WrongLength {
                what: "dofs",
                expected: count,
                got: m,
            });
        }
        self.known(dofs)?;
        self.projector.set_phase(phase);
        let rows = &mut self.scratch.rows;
        rows.reset(m);
        for (i, (&d, mean)) in dofs.iter().zip(mean.iter_mut()).enumerate() {
            let predicted = self.projector.row(d, &self.posterior.mean, |t, tile| {
                *rows.tile_mut(i, t) = tile
            });
            *mean = predicted.value;
        }
        self.posterior
            .root
            .solve_transposed(rows, PHASE_STATES, &mut self.scratch.column);
        for i in 0..m {
            for j in 0..=i {
                let sum = rows.dot(i, j, self.posterior.mean.len());
                covariance[i * m + j] = sum;
                covariance[j * m + i] = sum;
            }
        }
        check::all_finite("mean", mean)
            .and_then(|()| check::all_finite("covariance", covariance))
            .map_err(|_| BipError::Overflow { phase })
    }

    /// Time left until phase 1; `None` while the phase does not move forward.
    #[must_use]
    pub fn time_to_end(&mut self) -> Option<TimeToEnd> {
        let velocity = self.phase_velocity();
        if velocity <= 0.0 {
            return None;
        }
        let mean = (1.0 - self.phase()).max(0.0) / velocity;
        let p = self.phase_covariance();
        // d(mean) = -(d phase + mean d velocity) / velocity
        let variance = p[0][0] + 2.0 * mean * p[0][1] + mean * mean * p[1][1];
        let estimate = TimeToEnd {
            mean,
            sd: self.noise.time_spread * variance.max(0.0).sqrt() / velocity,
        };
        (estimate.mean.is_finite() && estimate.sd.is_finite()).then_some(estimate)
    }

    /// Probability that the motion is over after a time `dt`: that the phase has reached 1 by then.
    ///
    /// # Errors
    /// A `dt` that is negative or not finite.
    pub fn probability_ended(&mut self, dt: f64) -> Result<f64, BipError> {
        check::non_negative("dt", dt)?;
        let score = (self.phase() + dt * self.phase_velocity() - 1.0) / self.phase_sd_after(dt);
        check::finite("dt", score)?;
        Ok(below(score))
    }

    /// Standard deviation of the phase after a time `dt`.
    fn phase_sd_after(&mut self, dt: f64) -> f64 {
        let p = self.phase_covariance();
        let noise = 0.5 * self.dynamics.acceleration_sd * dt * dt;
        (p[0][0] + 2.0 * dt * p[0][1] + dt * dt * p[1][1] + noise * noise).sqrt()
    }
}

/// Probability of a standard normal variable below `z`.
fn below(z: f64) -> f64 {
    0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}

/// Standard deviation of a standard normal variable that is clamped to an interval.
fn spread_within(low: f64, high: f64) -> f64 {
    /// Beyond this many deviations there is nothing.
    const NOTHING: f64 = 8.0;
    if !(low < NOTHING && high > -NOTHING) {
        return 0.0;
    }
    let (low, high) = (low.max(-NOTHING), high.min(NOTHING));
    let density = |z: f64| (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    let (under, over) = (below(low), below(-high));
    let mean = low * under + high * over + density(low) - density(high);
    let square = low * low * under + high * high * over + (1.0 - under - over) + low * density(low)
        - high * density(high);
    (square - mean * mean).clamp(0.0, 1.0).sqrt()
}
