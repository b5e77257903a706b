//! Deviations that last: what was measured a moment ago says how this person differs now.
//!
//! A motion differs from what the model can express of it for many samples in the same direction.
//! As a Markov process `r(t + dt) = a r(t) + noise`, `a = exp(-dt / correlation time)`, that needs
//! no further state: the difference of a measurement and a share of the one before it has nearly
//! independent noise, and speaks about the motion at two phases [Bryson 1968].

use crate::error::{finite, length};
use crate::observation::Observation;
use crate::{BipError, Filter};

/// The last measurement of a degree of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Last {
    value: f64,
    clock: f64,
    travelled: f64,
}

/// The last measurements, and the time since.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Past {
    /// Time since the start.
    pub(crate) clock: f64,
    /// Time of it in which the phase moved.
    pub(crate) travelled: f64,
    last: Vec<Option<Last>>,
}

impl Past {
    pub(crate) fn new(dofs: usize) -> Self {
        Self {
            clock: 0.0,
            travelled: 0.0,
            last: vec![None; dofs],
        }
    }

    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.clock = other.clock;
        self.travelled = other.travelled;
        self.last.copy_from_slice(&other.last);
    }

    pub(crate) fn remember(&mut self, dof: usize, value: f64) {
        self.last[dof] = Some(Last {
            value,
            clock: self.clock,
            travelled: self.travelled,
        });
    }

    /// The shape is another one: old deviations say nothing.
    pub(crate) fn forget(&mut self) {
        self.last.fill(None);
    }

    /// The velocity is another one: it does not lead back to where the phase was.
    pub(crate) fn travelled_anew(&mut self) {
        for last in self.last.iter_mut().flatten() {
            last.travelled = self.travelled;
        }
    }
}

impl Filter {
    /// Share of the present deviation that is expected after a time, and the variance of the
    /// deviation then, both by the best linear prediction from one measurement. Of the noise,
    /// `noise_sd²`, the fit's variance is independent and the rest lasts.
    fn lasting(&self, d: usize, time: f64) -> (f64, f64) {
        let all = self.noise_sd[d].powi(2);
        let lasting = (all - self.white[d]).max(0.0);
        let share = (-time / self.correlation_time).exp() * lasting / all;
        (share, all * (1.0 - share * share))
    }

    /// Phase at which a degree of freedom was measured last, as seen from a phase and velocity.
    fn phase_before(&self, age: f64, [phase, velocity]: [f64; 2]) -> f64 {
        let before = phase - age * velocity;
        if self.clip {
            before.clamp(0.0, 1.0)
        } else {
            before
        }
    }

    /// Turns the prepared rows of an observation into differences to the last measurements.
    /// Returns the sum of the logarithms of the standard deviations.
    pub(crate) fn subtract_past(&mut self, observation: &Observation<'_>) -> f64 {
        let point = [self.scratch.point[0][0], self.scratch.point[0][1]];
        let moved = [point[0] - self.phase(), point[1] - self.phase_velocity()];
        let mut log_sd = 0.0;
        let mut evaluated = None;
        for (i, &at) in self.scratch.kept.iter().enumerate() {
            let d = observation.dofs[at];
            let Some(last) = self.past.last[d] else {
                log_sd += self.noise_sd[d].ln();
                continue;
            };
            let age = self.past.travelled - last.travelled;
            if evaluated != Some(age) {
                self.projector.set_phase(self.phase_before(age, point));
                evaluated = Some(age);
            }
            let (share, variance) = self.lasting(d, self.past.clock - last.clock);
            let sd = variance.sqrt();
            // The rows were made for the noise of the model.
            let scale = self.noise_sd[d] / sd;
            let old = share / sd;
            let rows = &mut self.scratch.rows;
            let predicted = self.projector.row(d, &self.state, |t, h| {
                for (r, h) in rows.tile_mut(i, t).iter_mut().zip(h) {
                    *r = *r * scale - old * h;
                }
            });
            // That phase is the present one less the way since: d/dphase 1, d/dvelocity -age.
            let slope = old * predicted.slope;
            let first = rows.tile_mut(i, 0);
            first[0] -= slope;
            first[1] += slope * age;
            rows.e[i] = rows.e[i] * scale
                - old * (last.value - predicted.value)
                - slope * (moved[0] - age * moved[1]);
            log_sd += sd.ln();
        }
        log_sd
    }

    /// Mean and variance of what will be measured at a later phase: the mean motion, the part of
    /// the present deviation that lasts until then, and what cannot be known.
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
        finite("phase", &[phase])?;
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
                let then = self
                    .projector
                    .row(d, &self.state, |t, tile| *rows.tile_mut(i, t) = tile);
                *mean = then.value;
            }
            for (i, &d) in dofs.iter().enumerate() {
                variance[i] = self.residual_sd[d].powi(2);
                let last = self.past.last[d].filter(|_| self.correlation_time > 0.0);
                let Some(last) = last else { continue };
                let age = self.past.travelled - last.travelled;
                let (share, rest) = self.lasting(d, left + self.past.clock - last.clock);
                self.projector.set_phase(self.phase_before(age, now));
                let rows = &mut self.scratch.rows;
                let old = self.projector.row(d, &self.state, |t, tile| {
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
            self.root
                .solve_transposed(rows, 0, &mut self.scratch.column);
            for (i, variance) in variance.iter_mut().enumerate() {
                *variance += rows.dot(i, i, self.state.len());
                *variance *= self.spread.powi(2);
            }
        }
        finite("mean", mean)
            .and_then(|()| finite("variance", variance))
            .map_err(|_| BipError::Overflow { phase })
    }
}
