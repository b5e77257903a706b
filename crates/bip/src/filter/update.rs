//! Measurement updates of a filter.

use super::low_rank::Filter;
use super::observation::{Noise, Observation, Update};
use crate::arithmetic::{LN_TAU, all_finite};
use crate::error::BipError;
use hwall_numeric::check;

impl Filter {
    /// Takes an observation of the present, at the estimated phase.
    ///
    /// # Errors
    /// Numbers that are not finite, unknown or repeated degrees of freedom, a noise that is not positive (definite).
    pub fn observe(&mut self, observation: &Observation<'_>) -> Result<Update, BipError> {
        self.observe_rows(None, observation)
    }

    /// Takes evidence about another phase: a via-point, or an end point estimated elsewhere. It concerns the shape of the motion only, not the
    /// present phase. Each call counts as new evidence: an estimate that is recomputed at every frame from the same samples must only be given
    /// once, or to a copy of the filter.
    ///
    /// # Errors
    /// As [`observe`](Self::observe); a phase that is not finite or so far out that a basis overflows.
    pub fn observe_at(
        &mut self,
        phase: f64,
        observation: &Observation<'_>,
    ) -> Result<Update, BipError> {
        check::finite("phase", phase)?;
        self.observe_rows(Some(phase), observation)
    }

    /// Takes evidence about the phase itself.
    ///
    /// # Errors
    /// A phase that is not finite, a variance that is not positive.
    pub fn observe_phase(&mut self, phase: f64, variance: f64) -> Result<Update, BipError> {
        check::finite("phase", phase)?;
        let sd = check::positive("variance", variance)?.sqrt();
        let innovation = phase - self.phase();
        let rows = &mut self.scratch.rows;
        rows.reset(1);
        rows.clear(0);
        rows.set(0, 0, 1.0 / sd);
        rows.e[0] = innovation / sd;
        let mut update = self.fold(1, phase)?;
        update.log_likelihood -= sd.ln();
        Ok(self.accept(update))
    }

    /// `fixed`: the phase of the observation, or `None` for the present one.
    fn observe_rows(
        &mut self,
        fixed: Option<f64>,
        observation: &Observation<'_>,
    ) -> Result<Update, BipError> {
        observation.validate(&mut self.scratch.seen)?;
        let all = 0..observation.dofs.len();
        observation.factor_noise(all.clone(), &mut self.scratch.lower)?;
        self.scratch.kept.clear();
        self.scratch.kept.extend(all);
        let refused = self.refuse_outliers(fixed, observation)?;
        let m = self.scratch.kept.len();
        let phase = fixed.unwrap_or(self.phase());
        let log_sd = self.linearize(fixed.is_some(), phase, observation);
        let mut update = self.fold(m, phase)?;
        update.log_likelihood -= log_sd;
        self.posterior.refused = refused.in_a_row;
        update.gated = refused.rows;
        update.log_likelihood += refused.log_likelihood;
        if fixed.is_none() && observation.noise == Noise::Model {
            for &at in &self.scratch.kept {
                self.posterior
                    .last
                    .remember(observation.dofs[at], observation.values[at]);
            }
        }
        Ok(self.accept(update))
    }

    /// Rows of the kept values: slopes in the state and residuals. Returns the sum of the log standard deviations.
    fn linearize(&mut self, at_phase: bool, phase: f64, observation: &Observation<'_>) -> f64 {
        let present = if at_phase { 0.0 } else { 1.0 };
        let state = &self.posterior.mean;
        let scratch = &mut self.scratch;
        let rows = &mut scratch.rows;
        let m = scratch.kept.len();
        rows.reset(m);
        // The gate has already evaluated the same rows.
        let known = self.gate.is_some();
        if !known {
            self.projector.set_phase(phase);
        }
        let mut log_sd = 0.0;
        for (i, &at) in scratch.kept.iter().enumerate() {
            let d = observation.dofs[at];
            let (sd, ln_sd) = match observation.noise {
                Noise::Model => (self.noise.sd[d], self.noise.ln_sd[d]),
                Noise::Variances(v) => (v[at].sqrt(), 0.5 * v[at].ln()),
                Noise::Covariance(_) => (1.0, 0.0),
            };
            let scale = 1.0 / sd;
            let predicted = if known {
                for t in 0..state.len() {
                    *rows.tile_mut(i, t) = scratch.plain.tile(at, t).map(|x| x * scale);
                }
                scratch.predicted[at]
            } else {
                self.projector.row(d, state, |t, h| {
                    *rows.tile_mut(i, t) = h.map(|x| x * scale);
                })
            };
            rows.set(i, 0, present * predicted.slope * scale);
            rows.e[i] = (observation.values[at] - predicted.value) * scale;
            log_sd += ln_sd;
        }
        if !at_phase && self.noise.correlation_time > 0.0 && observation.noise == Noise::Model {
            log_sd = self.subtract_lasting(observation);
        }
        if let Noise::Covariance(_) = observation.noise {
            let lower = &self.scratch.lower[..m * m];
            self.scratch.rows.whiten(lower);
            log_sd = (0..m).map(|i| lower[i * m + i].ln()).sum();
        }
        log_sd
    }

    /// Converts the prepared rows of an observation to differences from the last measurements. Returns the sum of the log standard deviations.
    fn subtract_lasting(&mut self, observation: &Observation<'_>) -> f64 {
        let scratch = &mut self.scratch;
        let state = &self.posterior.mean;
        let mut log_sd = 0.0;
        let mut evaluated = None;
        for (i, &at) in scratch.kept.iter().enumerate() {
            let d = observation.dofs[at];
            let Some(last) = self.posterior.last.of(d) else {
                log_sd += self.noise.ln_sd[d];
                continue;
            };
            let age = self.posterior.last.travelled_since(&last);
            if evaluated != Some(age) {
                let before = self.dynamics.clipped(state[0][0] - age * state[0][1]);
                self.projector.set_phase(before);
                evaluated = Some(age);
            }
            let time = self.posterior.last.time_since(&last);
            let lasting = self.noise.lasting(d, time);
            let sd = lasting.variance.sqrt();
            // The rows were scaled for the noise of the model.
            let scale = self.noise.sd[d] / sd;
            let old = lasting.share / sd;
            let rows = &mut scratch.rows;
            let predicted = self.projector.row(d, state, |t, h| {
                for (r, h) in rows.tile_mut(i, t).iter_mut().zip(h) {
                    *r = *r * scale - old * h;
                }
            });
            // The phase of the last measurement is the present one minus the distance since then: its derivatives are 1 by phase and -age by
            // velocity.
            let slope = old * predicted.slope;
            let first = rows.tile_mut(i, 0);
            first[0] -= slope;
            first[1] += slope * age;
            rows.e[i] = rows.e[i] * scale - old * (last.value - predicted.value);
            log_sd += sd.ln();
        }
        log_sd
    }

    /// Keeps in `kept` the indices of the values within the gate.
    fn refuse_outliers(
        &mut self,
        fixed: Option<f64>,
        observation: &Observation<'_>,
    ) -> Result<Refused, BipError> {
        let mut refused = Refused::default();
        let Some(gate) = self.gate else {
            return Ok(refused);
        };
        let phase = fixed.unwrap_or(self.phase());
        self.projector.set_phase(phase);
        let scratch = &mut self.scratch;
        let noise_variance = |at: usize| match observation.noise {
            Noise::Model => self.noise.sd[observation.dofs[at]].powi(2),
            Noise::Variances(v) => v[at],
            Noise::Covariance(c) => c[at * observation.dofs.len() + at],
        };
        let limit = gate.deviations.powi(2);
        let mut within = true;
        for (at, (&d, y)) in observation.dofs.iter().zip(observation.values).enumerate() {
            let plain = &mut scratch.plain;
            let predicted = self.projector.row(d, &self.posterior.mean, |t, tile| {
                *plain.tile_mut(at, t) = tile;
            });
            scratch.predicted[at] = predicted;
            // The prediction only adds to the variance, so a value within this limit is within the gate.
            within &= (y - predicted.value).powi(2) <= limit * noise_variance(at);
        }
        if within {
            if observation.dofs.is_empty() {
                refused.in_a_row = self.posterior.refused;
            }
            return Ok(refused);
        }
        let rows = &mut scratch.rows;
        rows.reset(observation.dofs.len());
        for (at, y) in observation.values.iter().enumerate() {
            for t in 0..self.posterior.mean.len() {
                *rows.tile_mut(at, t) = *scratch.plain.tile(at, t);
            }
            let predicted = scratch.predicted[at];
            if fixed.is_none() {
                rows.set(at, 0, predicted.slope);
            }
            rows.e[at] = y - predicted.value;
        }
        self.posterior
            .root
            .solve_transposed(rows, 0, &mut scratch.column);
        scratch.kept.clear();
        for at in 0..observation.dofs.len() {
            let variance = rows.dot(at, at, self.posterior.mean.len()) + noise_variance(at);
            let away = rows.e[at].powi(2);
            if away <= limit * variance {
                scratch.kept.push(at);
            } else if away.is_finite() {
                refused.rows += 1;
                refused.log_likelihood -= 0.5 * (limit + variance.ln() + LN_TAU);
            } else {
                return Err(BipError::Overflow { phase });
            }
        }
        refused.in_a_row = self.posterior.refused;
        if 2 * refused.rows > observation.dofs.len() {
            refused.in_a_row += 1;
            if self.posterior.refused >= gate.patience {
                self.scratch.kept.clear();
                self.scratch.kept.extend(0..observation.dofs.len());
                refused = Refused::default();
            }
        } else if !observation.dofs.is_empty() {
            refused.in_a_row = 0;
        }
        if refused.rows > 0 {
            let kept = self.scratch.kept.iter().copied();
            observation.factor_noise(kept, &mut self.scratch.lower)?;
        }
        Ok(refused)
    }

    /// Folds the prepared rows into a copy of the posterior; [`accept`](Self::accept) adopts it.
    fn fold(&mut self, m: usize, phase: f64) -> Result<Update, BipError> {
        let scratch = &mut self.scratch;
        scratch.root.copy_from(&self.posterior.root);
        if m == 0 {
            scratch.padded.as_flattened_mut().fill(0.0);
            return Ok(Update::NOTHING);
        }
        scratch.z.fill(0.0);
        let fold = scratch
            .root
            .fold(&mut scratch.rows, &mut scratch.z, &mut scratch.column);
        scratch.root.solve(&mut scratch.z, &mut scratch.padded);
        let finite = fold.distance_squared.is_finite() && fold.log_determinant.is_finite();
        if !(all_finite(&scratch.z) && finite) {
            return Err(BipError::Overflow { phase });
        }
        Ok(Update {
            rows: m,
            gated: 0,
            distance_squared: fold.distance_squared,
            log_likelihood: -0.5
                * (fold.distance_squared + fold.log_determinant + m as f64 * LN_TAU),
        })
    }

    fn accept(&mut self, update: Update) -> Update {
        let mean = self.posterior.mean.as_flattened_mut();
        for (x, dx) in mean.iter_mut().zip(self.scratch.padded.as_flattened()) {
            *x += dx;
        }
        std::mem::swap(&mut self.posterior.root, &mut self.scratch.root);
        self.posterior.clip_phase(self.dynamics);
        self.health.count(&update);
        update
    }
}

/// Rejected values, and their density at the gate.
#[derive(Debug, Clone, Copy, Default)]
struct Refused {
    rows: usize,
    /// Consecutive observations that were mostly rejected, including this one.
    in_a_row: usize,
    log_likelihood: f64,
}
