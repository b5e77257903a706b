//! Stevens' power law: magnitudes grow as a power of the stimulus.

use crate::error::{PsychophysicsError, Result, inner_probability};
use crate::tails::t_quantile_two_sided;
use hwall_numeric::check::positive;

/// An answer in magnitude estimation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MagnitudeAnswer {
    /// Size of the stimulus, in any unit.
    pub stimulus: f64,
    /// Reported magnitude.
    pub magnitude: f64,
}

/// `magnitude = constant · stimulus^exponent`, fitted to logarithms.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct PowerLaw {
    /// Exponent: below 1 the sensation is compressed, above 1 expanded.
    pub exponent: f64,
    /// Confidence interval of the exponent, lower and upper end.
    pub exponent_ci: [f64; 2],
    /// Magnitude of a stimulus of 1.
    pub constant: f64,
    /// Confidence interval of the constant, lower and upper end.
    pub constant_ci: [f64; 2],
    /// Share of the variance of the logarithms that the law explains.
    pub r2: f64,
    /// Standard deviation of the natural logarithms about the law.
    pub ln_sd: f64,
    /// Points.
    pub count: usize,
}

impl PowerLaw {
    /// Predicted magnitude of a stimulus.
    #[must_use]
    pub fn magnitude(&self, stimulus: f64) -> f64 {
        self.constant * stimulus.powf(self.exponent)
    }
}

/// Least squares of `ln magnitude` over `ln stimulus`, with intervals of the given confidence.
///
/// `answers`: means over subjects, or the answers of one subject. Single answers of several
/// subjects are not independent, so the intervals would be too narrow.
///
/// Source: Stevens 1957.
///
/// # Errors
/// Fewer than three answers, numbers that are not positive, equal stimuli, a confidence outside (0, 1).
pub fn stevens_fit(answers: &[MagnitudeAnswer], confidence: f64) -> Result<PowerLaw> {
    inner_probability("confidence", confidence)?;
    for answer in answers {
        positive("stimulus", answer.stimulus)?;
        positive("magnitude", answer.magnitude)?;
    }
    let count = answers.len();
    if count < 3 {
        let why = "fewer than three points";
        return Err(PsychophysicsError::NoFit { why });
    }
    let n = count as f64;
    let x: Vec<f64> = answers.iter().map(|a| a.stimulus.ln()).collect();
    let y: Vec<f64> = answers.iter().map(|a| a.magnitude.ln()).collect();
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let (mean_x, mean_y) = (mean(&x), mean(&y));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        x.iter()
            .zip(&y)
            .map(|(x, y)| f(x - mean_x, y - mean_y))
            .sum()
    };
    let xx = sum(&|x, _| x * x);
    if xx <= n * (8.0 * f64::EPSILON * mean_x.abs().max(1.0)).powi(2) {
        let why = "all stimuli are equal";
        return Err(PsychophysicsError::NoFit { why });
    }
    let exponent = sum(&|x, y| x * y) / xx;
    let left = sum(&|x, y| (y - exponent * x).powi(2));
    let total = sum(&|_, y| y * y);
    let variance = left / (n - 2.0);
    let quantile = t_quantile_two_sided(1.0 - confidence, n - 2.0);
    let half = quantile * (variance / xx).sqrt();
    let ln_constant = mean_y - exponent * mean_x;
    let ln_half = quantile * (variance * (1.0 / n + mean_x * mean_x / xx)).sqrt();
    Ok(PowerLaw {
        exponent,
        exponent_ci: [exponent - half, exponent + half],
        constant: ln_constant.exp(),
        constant_ci: [(ln_constant - ln_half).exp(), (ln_constant + ln_half).exp()],
        r2: if total > 0.0 { 1.0 - left / total } else { 1.0 },
        ln_sd: variance.sqrt(),
        count,
    })
}
