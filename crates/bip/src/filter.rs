//! The exact low-rank extended Kalman filter: phase, phase velocity and the coefficients.

use crate::error::{finite, not_negative, positive};
use crate::observation::Noise;
use crate::projector::{PHASE_STATES, Projector};
use crate::square_root::{LANES, Rows, SquareRoot, Tile, tiles};
use crate::{BipError, Model, Observation, Update};

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
    /// of length dt adds `[dt⁴/4, dt³/2; dt³/2, dt²]` times it. Default `None`: in one sampling
    /// period the phase velocity changes by one hundredth of its mean.
    pub acceleration_variance: Option<f64>,
    /// Measurement noise. Default [`NoiseSource::Best`].
    pub noise: NoiseSource,
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
    pub(crate) acceleration_sd: f64,
    clip: bool,
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
        let velocity = model.phase_velocity();
        let acceleration_sd = match config.acceleration_variance {
            Some(v) => {
                not_negative("acceleration variance", v)?;
                v.sqrt()
            }
            None => 0.01 * velocity.mean.abs() / model.sampling_period(),
        };
        let noise = match (config.noise, model.noise_held_out()) {
            (NoiseSource::Fit, _) | (NoiseSource::Best, None) => model.noise_fit(),
            (NoiseSource::Best | NoiseSource::HeldOut, Some(noise)) => noise,
            (NoiseSource::HeldOut, None) => {
                return Err(BipError::TooFewDemonstrations {
                    needed: 2,
                    got: model.demonstrations(),
                });
            }
        };
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
            noise_sd: noise.iter().map(|v| v.sqrt()).collect(),
            acceleration_sd,
            clip: config.clip_phase,
            state,
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
            },
            root,
        };
        filter.clip_phase();
        Ok(filter)
    }

    /// Lets `dt` pass: the phase moves on at its velocity, and both become less certain.
    ///
    /// Steps may have any length. Two steps of half the length add less uncertainty than one,
    /// because each draws its own acceleration.
    ///
    /// # Errors
    /// A `dt` that is negative or not finite.
    pub fn predict(&mut self, dt: f64) -> Result<(), BipError> {
        not_negative("dt", dt)?;
        let moved = self.phase() + dt * self.phase_velocity();
        let noise = self.acceleration_sd * dt;
        finite("dt", &[moved, noise * dt])?;
        // With p = F⁻¹ (p' - g v), v ~ N(0, 1), the top rows [A B] on (p, c) become
        // [-A F⁻¹ g, A F⁻¹, B] on (v, p', c); rotating v away leaves them triangular.
        let (g0, g1) = (0.5 * noise * dt, noise);
        let (top, second) = self.root.top_two_mut();
        top[0][1] -= dt * top[0][0];
        let a0 = -(top[0][0] * g0 + top[0][1] * g1);
        let a1 = -second[0][1] * g1;
        let h = a1.hypot(1.0);
        let (c, s) = (1.0 / h, a1 / h);
        let h2 = a0.hypot(h);
        let (c2, s2) = (h / h2, a0 / h2);
        for (top, second) in top.iter_mut().zip(second) {
            for (x, y) in top.iter_mut().zip(second) {
                let noise_row = s * *y;
                *y *= c;
                *x = c2 * *x - s2 * noise_row;
            }
        }
        self.state[0][0] = moved;
        self.clip_phase();
        Ok(())
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
    /// It speaks about the shape of the motion only, not about the present phase.
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
        for t in 0..self.state.len() {
            *rows.tile_mut(0, t) = [0.0; LANES];
        }
        rows.set(0, 0, 1.0 / sd);
        rows.e[0] = innovation / sd;
        self.fold(1, sd.ln(), phase)
    }

    /// `fixed`: the phase the observation speaks about, or `None` for the present one.
    fn observe_rows(
        &mut self,
        fixed: Option<f64>,
        observation: &Observation<'_>,
    ) -> Result<Update, BipError> {
        observation.validate(&mut self.scratch.seen)?;
        observation.factor_noise(&mut self.scratch.lower)?;
        let phase = fixed.unwrap_or(self.phase());
        let present = if fixed.is_none() { 1.0 } else { 0.0 };
        let m = observation.dofs.len();
        let rows = &mut self.scratch.rows;
        rows.reset(m);
        self.projector.set_phase(phase);
        let mut log_sd = 0.0;
        for (i, (&d, y)) in observation.dofs.iter().zip(observation.values).enumerate() {
            let sd = match observation.noise {
                Noise::Model => self.noise_sd[d],
                Noise::Variances(v) => v[i].sqrt(),
                Noise::Covariance(_) => 1.0,
            };
            let scale = 1.0 / sd;
            let predicted = self.projector.row(d, &self.state, |t, h| {
                *rows.tile_mut(i, t) = h.map(|x| x * scale);
            });
            rows.set(i, 0, present * predicted.slope * scale);
            rows.e[i] = (y - predicted.value) * scale;
            log_sd += sd.ln();
        }
        if let Noise::Covariance(_) = observation.noise {
            let lower = &self.scratch.lower[..m * m];
            rows.whiten(lower);
            log_sd = (0..m).map(|i| lower[i * m + i].ln()).sum();
        }
        self.fold(m, log_sd, phase)
    }

    /// Folds the prepared rows into the belief.
    fn fold(&mut self, m: usize, log_sd: f64, phase: f64) -> Result<Update, BipError> {
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
        for (x, dx) in self.state.iter_mut().zip(&scratch.padded) {
            for (x, dx) in x.iter_mut().zip(dx) {
                *x += dx;
            }
        }
        std::mem::swap(&mut self.root, &mut scratch.root);
        self.clip_phase();
        Ok(Update {
            rows: m,
            distance_squared: fold.distance_squared,
            log_likelihood: -0.5
                * (fold.distance_squared + fold.log_determinant + m as f64 * LN_TAU)
                - log_sd,
        })
    }

    fn clip_phase(&mut self) {
        if self.clip {
            self.state[0][0] = self.state[0][0].clamp(0.0, 1.0);
        }
    }
}
