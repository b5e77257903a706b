//! Intervals of effect sizes, from noncentral distributions.

use super::analyse::Analysis;
use super::anova::{Effect, ErrorModel};
use super::ratio::Ratio;
use crate::bisection::halved;
use crate::error::{Result, inner_probability};
use crate::tails::{noncentral_f_cdf, noncentral_t_cdf};
use hwall_numeric::check::{finite, that};

/// Size of an effect, with its interval.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EffectSize {
    /// The effect.
    pub name: String,
    /// The error model behind it.
    pub errors: ErrorModel,
    /// Partial eta squared of the sample; biased upwards by chance.
    pub partial_eta2: f64,
    /// Partial omega squared: estimate for the population, corrected for chance; 0 for an F below 1.
    pub partial_omega2: f64,
    /// Interval of the population's value; an end is zero if F is too small for the confidence. At
    /// confidences of 0.8 and more it contains `partial_omega2`, but not always `partial_eta2`.
    pub ci: [f64; 2],
}

/// Upper bound of the search for λ, and of |t|: sums of some thousand terms.
const MOST: f64 = 1e5;
const MOST_T: f64 = 200.0;
/// Upper bound of the search for a noncentrality of t.
const MOST_DELTA: f64 = 1000.0;

impl EffectSize {
    /// Effect size of a tested effect; `None` without a finite F, or if its noncentrality would exceed 1e5.
    ///
    /// `η² = λ / (λ + df1 + df2 + 1)` at the noncentralities λ at which the observed F has the two tail probabilities;
    /// `ω²` is the same at `λ = df1 (F − 1)`.
    ///
    /// Error: 1e-8. Without sphericity, the interval of an effect within subjects is too narrow, just as its p is too
    /// small. Source: Steiger 2004; Smithson 2003; Keren and Lewis 1979 for `ω²`.
    ///
    /// # Errors
    /// A confidence outside (0, 1).
    pub fn of(effect: &Effect, confidence: f64) -> Result<Option<Self>> {
        inner_probability("confidence", confidence)?;
        let (Ratio::Finite(f), Some(partial_eta2)) = (effect.f, effect.partial_eta2) else {
            return Ok(None);
        };
        let (df1, df2) = (effect.df1 as f64, effect.df2 as f64);
        let tail = 0.5 * (1.0 - confidence);
        let share = |lambda: f64| lambda / (lambda + df1 + df2 + 1.0);
        let end = |p: f64| falling_root(|l| noncentral_f_cdf(f, df1, df2, l) - p);
        let (Some(low), Some(high)) = (end(1.0 - tail), end(tail)) else {
            return Ok(None);
        };
        Ok(Some(Self {
            name: effect.name.clone(),
            errors: effect.errors,
            partial_eta2,
            partial_omega2: share((df1 * (f - 1.0)).max(0.0)),
            ci: [low, high].map(share),
        }))
    }
}

impl Analysis {
    /// Sizes of all effects that have one, in the order of [`Analysis::effects`].
    ///
    /// # Errors
    /// A confidence outside (0, 1).
    pub fn effect_sizes(&self, confidence: f64) -> Result<Vec<EffectSize>> {
        let sizes = self.effects.iter().map(|e| EffectSize::of(e, confidence));
        Ok(sizes
            .collect::<Result<Vec<_>, _>>()?
            .into_iter()
            .flatten()
            .collect())
    }
}

/// Interval of the standardised mean difference (Cohen's d of differences) from the sample's `dz` over `pairs` pairs.
///
/// Error: 1e-8. Source: Cumming and Finch 2001, by the noncentral t distribution.
///
/// # Errors
/// A number that is not finite; `t = dz √pairs` beyond 200; fewer than two pairs; a confidence outside (0, 1), or so
/// near to 1 that an end would lie beyond a noncentrality of 1000.
pub fn cohen_dz_interval(dz: f64, pairs: usize, confidence: f64) -> Result<[f64; 2]> {
    inner_probability("confidence", confidence)?;
    finite("dz", dz)?;
    that(
        (2..=100_000).contains(&pairs),
        "pairs",
        pairs as f64,
        "2 to 1e5",
    )?;
    let n = pairs as f64;
    let (t, df) = (dz * n.sqrt(), n - 1.0);
    that(
        t.abs() <= MOST_T,
        "dz times the root of pairs",
        t,
        "within 200 of zero",
    )?;
    let tail = 0.5 * (1.0 - confidence);
    // Wide enough for any confidence: t lies within a few standard deviations of its noncentrality.
    let reach = 50.0 + 4.0 * t.abs();
    let mut ends = [0.0; 2];
    for (end, p) in ends.iter_mut().zip([1.0 - tail, tail]) {
        let off = |delta: f64| noncentral_t_cdf(t, df, delta) - p;
        let low = (t - reach).max(-MOST_DELTA);
        let high = (t + reach).min(MOST_DELTA);
        let inside = off(low) >= 0.0 && off(high) <= 0.0;
        that(
            inside,
            "confidence",
            confidence,
            "less: an end of the interval is out of reach",
        )?;
        *end = halved([low, high], off, |_| 1e-13 * (1.0 + t.abs())) / n.sqrt();
    }
    Ok(ends)
}

/// Root of a decreasing function of a noncentrality; zero if it starts below zero, `None` if it ends above.
fn falling_root(of: impl Fn(f64) -> f64) -> Option<f64> {
    if of(0.0) <= 0.0 {
        return Some(0.0);
    }
    let (mut low, mut high) = (0.0, 1.0);
    while of(high) > 0.0 {
        (low, high) = (high, 2.0 * high);
        if high > MOST {
            return None;
        }
    }
    Some(halved([low, high], of, |high| 1e-13 * high))
}
