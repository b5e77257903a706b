//! Stevens' power law: estimates grow as a power of the stimulus.

use crate::PsychophysicsError;
use crate::error::check;
use crate::tails::t_quantile_two_sided;

/// `estimate = constant · stimulus^exponent`, fitted to logarithms.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct PowerLaw {
    /// Exponent: below 1 the sensation is compressed, above it expanded.
    pub exponent: f64,
    /// Confidence interval of the exponent.
    pub exponent_ci: [f64; 2],
    /// Estimate of a stimulus of 1, in units of the estimates.
    pub constant: f64,
    /// Confidence interval of the constant.
    pub constant_ci: [f64; 2],
    /// Share of the variance of the logarithms that the law explains.
    pub r2: f64,
    /// Standard deviation of the natural logarithms about the law.
    pub ln_sd: f64,
    /// Points.
    pub count: usize,
}

impl PowerLaw {
    /// The estimate that the law gives for a stimulus.
    #[must_use]
    pub fn estimate(&self, stimulus: f64) -> f64 {
        self.constant * stimulus.powf(self.exponent)
    }
}

/// Least squares of `ln estimate` over `ln stimulus`, with intervals of the given confidence.
///
/// Give means over subjects, or one subject's values: values of several subjects are not
/// independent, and the intervals would be too narrow.
///
/// Source: Stevens 1957.
///
/// # Errors
/// Fewer than three points, lengths that differ, values not above zero, equal stimuli.
pub fn stevens_fit(
    stimuli: &[f64],
    estimates: &[f64],
    confidence: f64,
) -> Result<PowerLaw, PsychophysicsError> {
    let inside = confidence > 0.0 && confidence < 1.0;
    check("confidence", confidence, inside, "above 0 and below 1")?;
    let count = stimuli.len();
    if estimates.len() != count {
        return Err(PsychophysicsError::Length {
            what: "estimates",
            got: estimates.len(),
            wanted: count,
        });
    }
    for (what, values) in [("stimulus", stimuli), ("estimate", estimates)] {
        for &value in values {
            check(what, value, value > 0.0, "above zero")?;
        }
    }
    if count < 3 {
        let why = "fewer than three points";
        return Err(PsychophysicsError::NoFit { why });
    }
    let n = count as f64;
    let logs = |values: &[f64]| -> Vec<f64> { values.iter().map(|v| v.ln()).collect() };
    let (x, y) = (logs(stimuli), logs(estimates));
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
