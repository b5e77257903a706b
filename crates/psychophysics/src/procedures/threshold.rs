//! Point of subjective equality, just noticeable difference and Weber fraction, with intervals.

use crate::error::{Result, inner_probability};
use crate::models::{PairAnswers, Psychometric, Sigmoid, fit_psychometric};
use crate::tails::normal_quantile;
use hwall_numeric::check::positive;

/// Results of the method of constant stimuli with two intervals: was the reference or the stimulus greater?
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Threshold {
    /// The function behind it.
    pub function: Psychometric,
    /// Interval of the point of subjective equality.
    pub pse_ci: [f64; 2],
    /// Interval of the just noticeable difference; both ends are above zero.
    pub jnd_ci: [f64; 2],
    /// Just noticeable difference divided by the reference.
    pub weber: f64,
    /// Interval of `weber`.
    pub weber_ci: [f64; 2],
}

/// Fits the answers to constant stimuli; `reference`: the stimulus present in every comparison.
///
/// Intervals come from the normal approximation of the maximum likelihood estimates: directly for the point of subjective equality,
/// and on the logarithm for the just noticeable difference, because the logarithm is closer to normal. With at least seven stimuli
/// of 20 trials, the coverage of 95 % intervals is right within 3 % (tests/it/procedures.rs).
///
/// # Errors
/// As [`fit_psychometric`]; a reference that is not above zero; a confidence outside (0, 1).
pub fn threshold(
    answers: &[PairAnswers],
    sigmoid: Sigmoid,
    reference: f64,
    confidence: f64,
) -> Result<Threshold> {
    inner_probability("confidence", confidence)?;
    positive("reference", reference)?;
    let function = fit_psychometric(answers, sigmoid)?;
    let z = normal_quantile(0.5 + 0.5 * confidence);
    let pse_half = z * function.pse_se;
    let factor = (z * function.jnd_se / function.jnd).exp();
    let jnd_ci = [function.jnd / factor, function.jnd * factor];
    Ok(Threshold {
        pse_ci: [function.pse - pse_half, function.pse + pse_half],
        jnd_ci,
        weber: function.jnd / reference,
        weber_ci: jnd_ci.map(|end| end / reference),
        function,
    })
}
