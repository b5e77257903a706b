//! Predictions of a filter: for the present, any phase, any later time, and the end.

use super::low_rank::Filter;
use super::noise::Lasting;
use super::posterior::{PHASE_STATES, PhaseEstimate};
use crate::arithmetic::all_finite;
use crate::error::{BipError, check_request, length};

/// Time left until the motion ends, to first order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeToEnd {
    /// `(1 - phase) / phase velocity`, in the unit of the demonstrations.
    pub mean: f64,
    /// Its standard deviation, by linearisation: too small if the velocity is uncertain, unless the model was [tuned](crate::judge::tune), which
    /// compensates for that.
    pub sd: f64,
}

/// Unless stated otherwise, variances are those of the trajectory itself; a measurement adds the noise of
/// [`noise_variance`](Filter::noise_variance). Queries with variances borrow the filter mutably because they use its scratch; they do not change
/// the estimate.
impl Filter {
    /// Covariance of phase and phase velocity.
    #[must_use]
    pub fn phase_covariance(&mut self) -> [[f64; 2]; 2] {
        let rows = &mut self.scratch.rows;
        rows.reset(2);
        for k in 0..2 {
            rows.clear(k);
            rows.set(k, k, 1.0);
        }
        self.solve_rows(0);
        let [variance, covariance, velocity_variance] =
            [(0, 0), (0, 1), (1, 1)].map(|(i, j)| self.product_of_rows(i, j));
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
    /// The phase is given; the uncertainty is that of the shape of the motion.
    ///
    /// # Errors
    /// A phase that is not finite or overflows, an unknown degree of freedom, wrong lengths.
    pub fn moments_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        self.in_parts(
            phase,
            dofs,
            mean,
            variance,
            |filter, dofs, mean, variance| {
                filter.set_rows(phase, dofs, mean);
                filter.solve_rows(PHASE_STATES);
                for (i, variance) in variance.iter_mut().enumerate() {
                    *variance = filter.product_of_rows(i, i);
                }
            },
        )
    }

    /// Checks a request and answers it in parts that fit the scratch, because a degree of freedom may be repeated.
    fn in_parts(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
        mut answer: impl FnMut(&mut Self, &[usize], &mut [f64], &mut [f64]),
    ) -> Result<(), BipError> {
        check_request(phase, dofs, self.dofs(), mean)?;
        length("variance", dofs.len(), variance.len())?;
        let capacity = self.scratch.rows.capacity();
        let parts = mean.chunks_mut(capacity).zip(variance.chunks_mut(capacity));
        for (dofs, (mean, variance)) in dofs.chunks(capacity).zip(parts) {
            answer(self, dofs, mean, variance);
        }
        finite(phase, mean, variance)
    }

    /// Rows of some degrees of freedom at a phase, at most the scratch capacity, and their means.
    fn set_rows(&mut self, phase: f64, dofs: &[usize], mean: &mut [f64]) {
        self.projector.set_phase(phase);
        let rows = &mut self.scratch.rows;
        rows.reset(dofs.len());
        for (i, (&d, mean)) in dofs.iter().zip(mean).enumerate() {
            let predicted = self.projector.row(d, &self.posterior.mean, |t, tile| {
                *rows.tile_mut(i, t) = tile
            });
            *mean = predicted.value;
        }
    }

    /// Replaces the rows so that their products are their covariances; the rows are zero before entry `from`.
    fn solve_rows(&mut self, from: usize) {
        let scratch = &mut self.scratch;
        let root = &self.posterior.root;
        root.solve_transposed(&mut scratch.rows, from, &mut scratch.column);
    }

    fn product_of_rows(&self, i: usize, j: usize) -> f64 {
        self.scratch.rows.dot(i, j, self.posterior.mean.len())
    }

    /// Mean and variance of a measurement at a later phase: the mean motion, the part of the present deviation that persists until then, and
    /// unpredictable noise.
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
        let now = [self.phase(), self.phase_velocity()];
        let left = if now[1] > 0.0 {
            ((phase - now[0]) / now[1]).max(0.0)
        } else {
            f64::INFINITY
        };
        self.in_parts(
            phase,
            dofs,
            mean,
            variance,
            |filter, dofs, mean, variance| {
                filter.set_rows(phase, dofs, mean);
                for (i, &d) in dofs.iter().enumerate() {
                    variance[i] = filter.noise.residual_sd[d].powi(2);
                    let lasts = filter.noise.correlation_time > 0.0;
                    let last = filter.posterior.last.of(d).filter(|_| lasts);
                    let Some(last) = last else { continue };
                    let age = filter.posterior.last.travelled_since(&last);
                    let time = left + filter.posterior.last.time_since(&last);
                    let Lasting {
                        share,
                        variance: rest,
                    } = filter.noise.lasting(d, time);
                    filter
                        .projector
                        .set_phase(filter.dynamics.clipped(now[0] - age * now[1]));
                    let rows = &mut filter.scratch.rows;
                    let old = filter.projector.row(d, &filter.posterior.mean, |t, tile| {
                        for (h, x) in rows.tile_mut(i, t).iter_mut().zip(tile) {
                            *h -= share * x;
                        }
                    });
                    rows.set(i, 0, -share * old.slope);
                    rows.set(i, 1, share * old.slope * age);
                    mean[i] += share * (last.value - old.value);
                    variance[i] = rest;
                }
                filter.solve_rows(0);
                for (i, variance) in variance.iter_mut().enumerate() {
                    *variance += filter.product_of_rows(i, i);
                    *variance *= filter.noise.spread.powi(2);
                }
            },
        )
    }

    /// Mean and covariance (row-major) of some degrees of freedom at a given phase, e.g. the three coordinates of a contact point at phase 1.
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
        let (m, count) = (dofs.len(), self.dofs());
        check_request(phase, dofs, count, mean)?;
        length("covariance", m * m, covariance.len())?;
        if m > count {
            return Err(BipError::WrongLength {
                what: "dofs",
                expected: count,
                got: m,
            });
        }
        self.set_rows(phase, dofs, mean);
        self.solve_rows(PHASE_STATES);
        for i in 0..m {
            for j in 0..=i {
                let sum = self.product_of_rows(i, j);
                covariance[i * m + j] = sum;
                covariance[j * m + i] = sum;
            }
        }
        finite(phase, mean, covariance)
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
}

fn finite(phase: f64, mean: &[f64], second: &[f64]) -> Result<(), BipError> {
    if all_finite(mean) && all_finite(second) {
        Ok(())
    } else {
        Err(BipError::Overflow { phase })
    }
}
