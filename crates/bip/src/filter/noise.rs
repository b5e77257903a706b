//! Deviations of measurements from what the model can express.
//!
//! They have the same direction for many samples and are modelled as a Markov process `r(t + dt) = a r(t) + noise`, `a = exp(-dt / correlation
//! time)`. It needs no further state: the difference between a measurement and a share of the previous one has nearly independent noise, and
//! depends on the motion at two phases [Bryson 1968].

use super::config::{FilterConfig, NoiseSource};
use crate::error::BipError;
use crate::model::Model;
use hwall_numeric::check;

/// Measurement noise of every degree of freedom.
#[derive(Debug, Clone)]
pub(crate) struct NoiseModel {
    /// Standard deviation of a measurement.
    pub sd: Vec<f64>,
    /// Logarithms of `sd`.
    pub ln_sd: Vec<f64>,
    /// Standard deviation on held-out demonstrations, without the factor.
    pub residual_sd: Vec<f64>,
    /// Factor on the standard deviations of predicted measurements.
    pub spread: f64,
    /// Factor on the standard deviation of the time to the end.
    pub time_spread: f64,
    /// Correlation time of deviations; 0 for none.
    pub correlation_time: f64,
    /// Variance of the independent part.
    independent: Vec<f64>,
}

/// Prediction of a later deviation from a measurement.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lasting {
    /// Expected share of the present deviation at that time.
    pub share: f64,
    /// Variance of the deviation at that time.
    pub variance: f64,
}

impl NoiseModel {
    pub(crate) fn new(model: &Model, config: &FilterConfig) -> Result<Self, BipError> {
        let tuning = model.tuning();
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
        check::non_negative("correlation time", correlation_time)?;
        let factor = config.noise_factor.unwrap_or(tuned);
        check::positive("noise factor", factor)?;
        let sd: Vec<f64> = noise.iter().map(|v| (factor * v).sqrt()).collect();
        Ok(Self {
            ln_sd: sd.iter().map(|sd| sd.ln()).collect(),
            sd,
            residual_sd: residual.iter().map(|v| v.sqrt()).collect(),
            spread: tuning.map_or(1.0, |t| t.spread),
            time_spread: tuning.map_or(1.0, |t| t.time_spread),
            correlation_time,
            independent: model.noise_fit().to_vec(),
        })
    }

    /// Best linear prediction of a deviation after a time, from one measurement. The part with the variance of the fit is independent; the rest
    /// of the noise persists.
    pub(super) fn lasting(&self, dof: usize, time: f64) -> Lasting {
        let all = self.sd[dof].powi(2);
        let lasting = (all - self.independent[dof]).max(0.0);
        let share = (-time / self.correlation_time).exp() * lasting / all;
        Lasting {
            share,
            variance: all * (1.0 - share * share),
        }
    }
}
