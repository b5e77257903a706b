//! Deviations that last: what was measured a moment ago says how this person differs now.
//!
//! A motion differs from what the model can express of it for many samples in the same direction.
//! As a Markov process `r(t + dt) = a r(t) + noise`, `a = exp(-dt / correlation time)`, that needs
//! no further state: the difference of a measurement and `a` times the one before it has
//! independent noise, and speaks about the motion at two phases [Bryson 1968].

use crate::error::{finite, length};
use crate::observation::Observation;
use crate::projector::PHASE_STATES;
use crate::square_root::{LANES, tile_dot};
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
    /// Turns the prepared rows of an observation into differences to the last measurements.
    /// Returns the sum of the logarithms of the standard deviations.
    pub(crate) fn subtract_past(&mut self, observation: &Observation<'_>) -> f64 {
        let scratch = &mut self.scratch;
        let (phase, velocity) = (scratch.point[0][0], scratch.point[0][1]);
        let mut log_sd = 0.0;
        let mut evaluated = None;
        for (i, &at) in scratch.kept.iter().enumerate() {
            let d = observation.dofs[at];
            let own = self.noise_sd[d].powi(2);
            let rows = &mut scratch.rows;
            let Some(last) = self.past.last[d] else {
                log_sd += self.noise_sd[d].ln();
                continue;
            };
            let age = self.past.travelled - last.travelled;
            if evaluated != Some(age) {
                let before = phase - age * velocity;
                let before = if self.clip {
                    before.clamp(0.0, 1.0)
                } else {
                    before
                };
                self.projector.set_phase(before);
                evaluated = Some(age);
            }
            let a = (-(self.past.clock - last.clock) / self.correlation_time).exp();
            let white = self.white[d].min(own);
            let variance = (own - white) * (1.0 - a * a) + white * (1.0 + a * a);
            let sd = variance.sqrt();
            // The rows were made for the noise of the model.
            let scale = self.noise_sd[d] / sd;
            let old = a / sd;
            let predicted = self.projector.row(d, &self.state, |t, h| {
                let row = rows.tile_mut(i, t);
                for (r, h) in row.iter_mut().zip(h) {
                    *r = *r * scale - h * old;
                }
            });
            let moved = [phase - self.state[0][0], velocity - self.state[0][1]];
            let slope = predicted.slope;
            let first = rows.tile_mut(i, 0);
            first[0] = first[0] - old * slope;
            first[1] = old * slope * age;
            rows.e[i] = rows.e[i] * scale
                - old * (last.value - predicted.value)
                - old * slope * (moved[0] - age * moved[1]);
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
        self.moments_at(phase, dofs, mean, variance)?;
        length("mean", dofs.len(), mean.len())?;
        let (now, velocity) = (self.phase(), self.phase_velocity());
        let left = if velocity > 0.0 {
            ((phase - now) / velocity).max(0.0)
        } else {
            f64::INFINITY
        };
        for ((&d, mean), variance) in dofs.iter().zip(mean.iter_mut()).zip(variance.iter_mut()) {
            let own = self.noise_sd[d].powi(2).max(self.white[d]);
            let residual = self.residual_sd[d].powi(2);
            let last = self.past.last[d].filter(|_| self.correlation_time > 0.0);
            let Some(last) = last else {
                *variance = self.spread.powi(2) * (*variance + residual);
                continue;
            };
            let age = self.past.travelled - last.travelled;
            let waited = left + self.past.clock - last.clock;
            let a = (-waited / self.correlation_time).exp();
            self.projector.set_phase(phase);
            let h = &mut self.scratch.padded;
            let then = self.projector.row(d, &self.state, |t, tile| h[t] = tile);
            let before = now - age * velocity;
            let before = if self.clip {
                before.clamp(0.0, 1.0)
            } else {
                before
            };
            self.projector.set_phase(before);
            let old = self.projector.row(d, &self.state, |t, tile| {
                for (h, x) in h[t].iter_mut().zip(tile) {
                    *h -= a * x;
                }
            });
            h[0][0] = -a * old.slope;
            h[0][1] = a * old.slope * age;
            self.root.solve_transposed(h, 0);
            let white = self.white[d];
            let kept = (own - white).max(0.0);
            // The last measurement is the deviation and its own noise: trusted by their shares.
            *mean = then.value + a * (last.value - old.value);
            *variance = self.spread.powi(2)
                * (tile_dot(h, h) + kept * (1.0 - a * a) + white * (1.0 + a * a));
        }
        let _ = (PHASE_STATES, LANES);
        finite("mean", mean).map_err(|_| BipError::Overflow { phase })?;
        finite("variance", variance).map_err(|_| BipError::Overflow { phase })
    }
}
