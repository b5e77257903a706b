//! The exact low-rank extended Kalman filter: phase, phase velocity and the coefficients.

use crate::error::{finite, not_negative, positive};
use crate::observation::Noise;
use crate::past::Past;
use crate::projector::{PHASE_STATES, Projector};
use crate::square_root::{LANES, Rows, SquareRoot, Tile, tiles};
use crate::{BipError, Gate, Health, Model, Observation, Update};

/// Which measurement noise a filter starts with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseSource {
    /// Residual of the fit: the published convention. Too small for a new person.
    Fit,
    /// Residual of held-out demonstrations.
    HeldOut,
    /// Held out where the model has it, else the fit.
    Best,
}

/// Parameters of a filter. Time has the unit of the demonstrations.
#[derive(Debug, Clone, PartialEq)]
pub struct FilterConfig {
    /// Phase at the start. Default 0.
    pub phase: f64,
    /// Variance of the phase at the start. Default 1e-4: one hundredth of the motion.
    pub phase_variance: f64,
    /// Variance of the random acceleration of the phase, 1/time⁴, constant within a step: a step
    /// of length dt adds `[dt⁴/4, dt³/2; dt³/2, dt²]` times it. Default `None`: as the model was
    /// [tuned](crate::tune), else such that in one sampling period the phase velocity changes by
    /// one hundredth of its mean.
    pub acceleration_variance: Option<f64>,
    /// Measurement noise. Default [`NoiseSource::Best`].
    pub noise: NoiseSource,
    /// Factor on the variance of that noise. A person deviates from the demonstrations for many
    /// samples in the same direction, which independent noise has to make up for by its size.
    /// Default `None`: as the model was [tuned](crate::tune) (for held-out noise), else 1.
    pub noise_factor: Option<f64>,
    /// Refusal of outliers. Default `None`: everything is believed.
    pub gate: Option<Gate>,
    /// Linearisations an observation of the present; more than one iterates the update around its
    /// own result, which helps where one observation moves the phase far. Default 1.
    pub iterations: usize,
    /// Time over which a deviation of the motion from what the model can express lasts: deviations
    /// are taken as a first-order Markov process of the variance of the noise, beside independent
    /// noise of the variance of the fit. Default `None`: as the model was [tuned](crate::tune),
    /// else 0, independent from sample to sample. Observations that bring their own noise are taken
    /// as independent.
    pub correlation_time: Option<f64>,
    /// Keep the mean of the phase within `[0, 1]`. Default `true`.
    pub clip_phase: bool,
}

impl Default for FilterConfig {
    fn default() -> Self {
        Self {
            phase: 0.0,
            phase_variance: 1e-4,
            acceleration_variance: None,
            noise: NoiseSource::Best,
            noise_factor: None,
            gate: None,
            iterations: 1,
            correlation_time: None,
            clip_phase: true,
        }
    }
}

/// Scratch of one update, allocated once.
#[derive(Debug, Clone)]
pub(crate) struct Scratch {
    pub(crate) rows: Rows,
    pub(crate) root: SquareRoot,
    pub(crate) column: Vec<f64>,
    pub(crate) z: Vec<f64>,
    pub(crate) padded: Vec<Tile>,
    pub(crate) lower: Vec<f64>,
    pub(crate) seen: Vec<bool>,
    /// Places in an observation of the values that are believed.
    pub(crate) kept: Vec<usize>,
    /// Where an iterated update is linearised.
    pub(crate) point: Vec<Tile>,
}

/// A belief about one motion in progress.
///
/// State: phase, phase velocity, coefficients `c`; the belief about them is kept as a square root
/// of the information matrix, so it stays symmetric and positive definite by construction.
/// [`predict`](Self::predict) moves the phase on, [`observe`](Self::observe) and its siblings take
/// evidence; neither allocates. An error leaves the belief as it was.
///
/// Source: [Campbell 2017]; the restriction to the span of the demonstrations is exact because
/// the weights have no process noise.
#[derive(Debug, Clone)]
pub struct Filter {
    pub(crate) projector: Projector,
    pub(crate) noise_sd: Vec<f64>,
    pub(crate) residual_sd: Vec<f64>,
    pub(crate) spread: f64,
    /// Variance of the independent part of the noise.
    pub(crate) white: Vec<f64>,
    pub(crate) correlation_time: f64,
    pub(crate) past: Past,
    pub(crate) acceleration_sd: f64,
    pub(crate) clip: bool,
    gate: Option<Gate>,
    iterations: usize,
    /// Observations in a row that were mostly refused.
    pub(crate) refused: usize,
    pub(crate) health: Health,
    /// Mean of the state, padded.
    pub(crate) state: Vec<Tile>,
    pub(crate) size: usize,
    pub(crate) root: SquareRoot,
    pub(crate) scratch: Scratch,
}

/// `ln(2 π)`.
const LN_TAU: f64 = 1.837_877_066_409_345_5;

impl Filter {
    /// A belief before anything is seen.
    ///
    /// # Errors
    /// Parameters outside their ranges; held-out noise that the model does not have.
    pub fn new(model: &Model, config: &FilterConfig) -> Result<Self, BipError> {
        finite("phase", &[config.phase])?;
        positive("phase variance", config.phase_variance)?;
        if let Some(gate) = config.gate {
            positive("deviations of the gate", gate.deviations)?;
        }
        if config.iterations == 0 {
            return Err(BipError::Parameter {
                what: "iterations",
                value: 0.0,
                wanted: "at least 1",
            });
        }
        let velocity = model.phase_velocity();
        let tuning = model.tuning();
        let acceleration = config
            .acceleration_variance
            .or(tuning.map(|t| t.acceleration_variance));
        let acceleration_sd = match acceleration {
            Some(v) => {
                not_negative("acceleration variance", v)?;
                v.sqrt()
            }
            None => 0.01 * velocity.mean.abs() / model.sampling_period(),
        };
        let residual = model.noise_held_out().unwrap_or(model.noise_fit());
        let (noise, tuned) = match (config.noise, model.noise_held_out()) {
            (NoiseSource::Fit, _) | (NoiseSource::Best, None) => (model.noise_fit(), 1.0),
            (NoiseSource::Best | NoiseSource::HeldOut, Some(noise)) => {
                (noise, tuning.map_or(1.0, |t| t.noise_factor))
            }
            (NoiseSource::HeldOut, None) => {
                return Err(BipError::TooFewDemonstrations {
                    needed: 2,
                    got: model.demonstrations(),
                });
            }
        };
        let correlation_time = config
            .correlation_time
            .or(tuning.map(|t| t.correlation_time))
            .unwrap_or(0.0);
        not_negative("correlation time", correlation_time)?;
        let factor = config.noise_factor.unwrap_or(tuned);
        positive("noise factor", factor)?;
        let size = PHASE_STATES + model.rank();
        let mut deviations = vec![1.0; size];
        deviations[0] = config.phase_variance.sqrt();
        deviations[1] = velocity.variance.sqrt();
        let root = SquareRoot::from_deviations(&deviations);
        let mut state = vec![[0.0; LANES]; tiles(size)];
        state[0][0] = config.phase;
        state[0][1] = velocity.mean;
        let dofs = model.dofs();
        let mut filter = Self {
            projector: Projector::new(model),
            noise_sd: noise.iter().map(|v| (factor * v).sqrt()).collect(),
            residual_sd: residual.iter().map(|v| v.sqrt()).collect(),
            white: model.noise_fit().to_vec(),
            correlation_time,
            past: Past::new(model.dofs()),
            spread: tuning.map_or(1.0, |t| t.spread),
            acceleration_sd,
            clip: config.clip_phase,
            gate: config.gate,
            iterations: config.iterations,
            refused: 0,
            health: Health::NEW,
            size,
            scratch: Scratch {
                // Two at least, for the phase and its velocity.
                rows: Rows::new(size, dofs.max(2)),
                root: root.clone(),
                column: vec![0.0; dofs.max(2)],
                z: vec![0.0; size],
                padded: vec![[0.0; LANES]; tiles(size)],
                lower: vec![0.0; dofs * dofs],
                seen: vec![false; dofs],
                kept: Vec::with_capacity(dofs),
                point: state.clone(),
            },
            state,
            root,
        };
        filter.clip_phase();
        Ok(filter)
    }

    /// Takes an observation of the present, at the phase the filter believes in.
    ///
    /// # Errors
    /// Numbers that are not finite, unknown or repeated degrees of freedom, a noise that is not
    /// positive (definite).
    pub fn observe(&mut self, observation: &Observation<'_>) -> Result<Update, BipError> {
        self.observe_rows(None, observation)
    }

    /// Takes evidence about another phase: a via-point, or an end point estimated elsewhere.
    /// It speaks about the shape of the motion only, not about the present phase. Each call is new
    /// evidence: an estimate that is renewed at every frame from the same samples must not be given
    /// again and again, but once, or to a copy of the filter.
    ///
    /// # Errors
    /// As [`observe`](Self::observe); a phase that is not finite or so far out that a basis overflows.
    pub fn observe_at(
        &mut self,
        phase: f64,
        observation: &Observation<'_>,
    ) -> Result<Update, BipError> {
        finite("phase", &[phase])?;
        self.observe_rows(Some(phase), observation)
    }

    /// Takes evidence about the phase itself.
    ///
    /// # Errors
    /// A phase that is not finite, a variance that is not positive.
    pub fn observe_phase(&mut self, phase: f64, variance: f64) -> Result<Update, BipError> {
        finite("phase", &[phase])?;
        positive("variance", variance)?;
        let sd = variance.sqrt();
        let innovation = phase - self.phase();
        let rows = &mut self.scratch.rows;
        rows.reset(1);
        rows.clear(0);
        rows.set(0, 0, 1.0 / sd);
        rows.e[0] = innovation / sd;
        let mut update = self.fold(1, phase)?;
        update.log_likelihood -= sd.ln();
        self.accept(update)
    }

    /// `fixed`: the phase the observation speaks about, or `None` for the present one.
    fn observe_rows(
        &mut self,
        fixed: Option<f64>,
        observation: &Observation<'_>,
    ) -> Result<Update, BipError> {
        observation.validate(&mut self.scratch.seen)?;
        self.scratch.kept.clear();
        self.scratch.kept.extend(0..observation.dofs.len());
        observation.factor_noise(&mut self.scratch.lower)?;
        let refused = self.refuse_outliers(fixed, observation)?;
        let m = self.scratch.kept.len();
        self.scratch.point.copy_from_slice(&self.state);
        let iterations = if fixed.is_some() { 1 } else { self.iterations };
        let mut first = None;
        for _ in 0..iterations {
            let phase = fixed.unwrap_or(self.scratch.point[0][0]);
            let log_sd = self.linearize(fixed.is_some(), phase, observation);
            let mut update = self.fold(m, phase)?;
            update.log_likelihood -= log_sd;
            // The density of an observation is that of its prediction, before any iteration.
            first.get_or_insert(update);
            let before = self.scratch.point[0][0];
            for ((point, x), dx) in self
                .scratch
                .point
                .as_flattened_mut()
                .iter_mut()
                .zip(self.state.as_flattened())
                .zip(self.scratch.padded.as_flattened())
            {
                *point = x + dx;
            }
            if self.clip {
                self.scratch.point[0][0] = self.scratch.point[0][0].clamp(0.0, 1.0);
            }
            if (self.scratch.point[0][0] - before).abs() < 1e-9 {
                break;
            }
        }
        let mut update = first.unwrap_or(Update::NOTHING);
        self.refused = refused.in_a_row;
        update.gated = refused.rows;
        update.log_likelihood += refused.log_likelihood;
        if fixed.is_none() && observation.noise == Noise::Model {
            for &at in &self.scratch.kept {
                self.past
                    .remember(observation.dofs[at], observation.values[at]);
            }
        }
        self.accept(update)
    }

    /// Rows of the kept values around the point: slopes in the state, residuals as seen from the
    /// state before the update. Returns the sum of the logarithms of the standard deviations.
    fn linearize(&mut self, at_phase: bool, phase: f64, observation: &Observation<'_>) -> f64 {
        let present = if at_phase { 0.0 } else { 1.0 };
        let scratch = &mut self.scratch;
        let rows = &mut scratch.rows;
        let m = scratch.kept.len();
        rows.reset(m);
        self.projector.set_phase(phase);
        let mut log_sd = 0.0;
        let moved = scratch.point[0][0] - self.state[0][0];
        for (i, &at) in scratch.kept.iter().enumerate() {
            let d = observation.dofs[at];
            let sd = match observation.noise {
                Noise::Model => self.noise_sd[d],
                Noise::Variances(v) => v[at].sqrt(),
                Noise::Covariance(_) => 1.0,
            };
            let scale = 1.0 / sd;
            // The prediction is linear in the coefficients: only the slope and the value that
            // belongs to the phase come from the point, the coefficients may stay at the state.
            let predicted = self.projector.row(d, &self.state, |t, h| {
                *rows.tile_mut(i, t) = h.map(|x| x * scale);
            });
            let slope = if scratch.point[..] == self.state[..] {
                predicted.slope
            } else {
                self.projector.row(d, &scratch.point, |_, _| ()).slope
            };
            rows.set(i, 0, present * slope * scale);
            rows.e[i] =
                (observation.values[at] - predicted.value + present * slope * moved) * scale;
            log_sd += sd.ln();
        }
        if !at_phase && self.correlation_time > 0.0 && observation.noise == Noise::Model {
            log_sd = self.subtract_past(observation);
        }
        let scratch = &mut self.scratch;
        if let Noise::Covariance(_) = observation.noise {
            let lower = &scratch.lower[..m * m];
            let rows = &mut scratch.rows;
            rows.whiten(lower);
            log_sd = (0..m).map(|i| lower[i * m + i].ln()).sum();
        }
        log_sd
    }

    /// Leaves in `kept` the places of the values that lie within the gate.
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
        let rows = &mut scratch.rows;
        rows.reset(observation.dofs.len());
        for (at, (&d, y)) in observation.dofs.iter().zip(observation.values).enumerate() {
            let predicted = self
                .projector
                .row(d, &self.state, |t, tile| *rows.tile_mut(at, t) = tile);
            if fixed.is_none() {
                rows.set(at, 0, predicted.slope);
            }
            rows.e[at] = y - predicted.value;
        }
        self.root.solve_transposed(rows, 0, &mut scratch.column);
        scratch.kept.clear();
        for (at, &d) in observation.dofs.iter().enumerate() {
            let variance = rows.dot(at, at, self.state.len())
                + match observation.noise {
                    Noise::Model => self.noise_sd[d].powi(2),
                    Noise::Variances(v) => v[at],
                    Noise::Covariance(c) => c[at * observation.dofs.len() + at],
                };
            let away = rows.e[at].powi(2);
            let limit = gate.deviations.powi(2);
            if away <= limit * variance {
                scratch.kept.push(at);
            } else if away.is_finite() {
                refused.rows += 1;
                refused.log_likelihood -= 0.5 * (limit + variance.ln() + LN_TAU);
            } else {
                return Err(BipError::Overflow { phase });
            }
        }
        refused.in_a_row = self.refused;
        if 2 * refused.rows > observation.dofs.len() {
            refused.in_a_row += 1;
            if self.refused >= gate.patience {
                self.scratch.kept.clear();
                self.scratch.kept.extend(0..observation.dofs.len());
                refused = Refused::default();
            }
        } else if !observation.dofs.is_empty() {
            refused.in_a_row = 0;
        }
        if refused.rows > 0 {
            observation.factor_noise_of(&self.scratch.kept, &mut self.scratch.lower)?;
        }
        Ok(refused)
    }

    /// Folds the prepared rows into a copy of the belief; [`accept`](Self::accept) makes it ours.
    fn fold(&mut self, m: usize, phase: f64) -> Result<Update, BipError> {
        let scratch = &mut self.scratch;
        if !scratch.rows.is_finite() {
            return Err(BipError::Overflow { phase });
        }
        scratch.root.copy_from(&self.root);
        scratch.z.fill(0.0);
        let fold = scratch
            .root
            .fold(&mut scratch.rows, &mut scratch.z, &mut scratch.column);
        scratch.root.solve(&mut scratch.z, &mut scratch.padded);
        let change: f64 = scratch.z.iter().map(|z| 0.0 * z).sum();
        if !(change == 0.0 && fold.distance_squared.is_finite()) {
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

    fn accept(&mut self, update: Update) -> Result<Update, BipError> {
        for (x, dx) in self.state.iter_mut().zip(&self.scratch.padded) {
            for (x, dx) in x.iter_mut().zip(dx) {
                *x += dx;
            }
        }
        std::mem::swap(&mut self.root, &mut self.scratch.root);
        self.clip_phase();
        self.health.count(&update);
        Ok(update)
    }

    pub(crate) fn clip_phase(&mut self) {
        if self.clip {
            self.state[0][0] = self.state[0][0].clamp(0.0, 1.0);
        }
    }
}

/// Values that were not believed, and the density they would have had at the gate.
#[derive(Debug, Clone, Copy, Default)]
struct Refused {
    rows: usize,
    /// Observations in a row that were mostly refused, with this one.
    in_a_row: usize,
    log_likelihood: f64,
}
