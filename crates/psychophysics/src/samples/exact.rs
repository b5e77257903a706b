//! Exact tests and intervals for few answers: shares, signs, medians.

use crate::bisection::halved;
use crate::error::{Result, inner_probability};
use crate::tails::{binomial_upper_tail, ln_choose};
use hwall_numeric::check::{all_finite, that};

/// Largest number of trials; up to this number the sum over all outcomes is short.
const MOST_TRIALS: u64 = 100_000;

/// A share of successes with its interval.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Share {
    /// Successes.
    pub successes: u64,
    /// Trials.
    pub trials: u64,
    /// Clopper and Pearson's interval, which covers the true share at least as often as the confidence says.
    pub ci: [f64; 2],
}

impl Share {
    /// The share of successes, with Clopper and Pearson's interval.
    ///
    /// Error: below 1e-12, as R's `binom.test`. Source: Clopper and Pearson 1934.
    ///
    /// # Errors
    /// No trials, or above 1e5; more successes than trials; a confidence outside (0, 1).
    pub fn of(successes: u64, trials: u64, confidence: f64) -> Result<Self> {
        check_counts(successes, trials)?;
        let half = 0.5 * (1.0 - inner_probability("confidence", confidence)?);
        // The share at which `at_least` or more successes have this probability.
        let share = |at_least: u64, probability: f64| {
            let short = |share| probability - binomial_upper_tail(at_least, trials, share);
            halved([0.0, 1.0], short, |high| f64::EPSILON * high)
        };
        let low = match successes {
            0 => 0.0,
            _ => share(successes, half),
        };
        let high = match successes == trials {
            true => 1.0,
            false => share(successes + 1, 1.0 - half),
        };
        Ok(Self {
            successes,
            trials,
            ci: [low, high],
        })
    }
}

fn check_counts(successes: u64, trials: u64) -> Result<()> {
    let holds = (1..=MOST_TRIALS).contains(&trials);
    that(holds, "trials", trials as f64, "1 to 1e5")?;
    let holds = successes <= trials;
    that(holds, "successes", successes as f64, "at most the trials")?;
    Ok(())
}

/// Two-sided p of a binomial test of `share`: the probability of all outcomes that are no more likely than this one.
///
/// Error: below 1e-9 relative, as R's `binom.test`.
///
/// # Errors
/// As [`Share::of`]; a share outside (0, 1).
pub fn binomial_test(successes: u64, trials: u64, share: f64) -> Result<f64> {
    check_counts(successes, trials)?;
    inner_probability("share", share)?;
    let ln_mass = |k: u64| {
        let (hits, misses) = (k as f64, (trials - k) as f64);
        ln_choose(trials, k) + hits * share.ln() + misses * (-share).ln_1p()
    };
    // With R's tolerance, so that outcomes that are equally likely except for rounding count.
    let most = ln_mass(successes) + 1e-7;
    let masses = (0..=trials).map(ln_mass).filter(|ln| *ln <= most);
    Ok(masses.map(f64::exp).sum::<f64>().min(1.0))
}

/// The sign test of differences.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct SignTest {
    /// Differences above zero.
    pub positive: u64,
    /// Differences below zero.
    pub negative: u64,
    /// Differences of zero, which do not count.
    pub zero: u64,
    /// Two-sided p: the binomial test of positive against negative differences; 1 if there are neither.
    pub p: f64,
}

/// Tests whether positive and negative differences are equally likely.
///
/// # Errors
/// A difference that is not finite; more than 1e5 differences.
pub fn sign_test(differences: &[f64]) -> Result<SignTest> {
    all_finite("difference", differences)?;
    let count = |of: fn(&f64) -> bool| differences.iter().filter(|d| of(d)).count() as u64;
    let (positive, negative) = (count(|d| *d > 0.0), count(|d| *d < 0.0));
    Ok(SignTest {
        positive,
        negative,
        zero: differences.len() as u64 - positive - negative,
        p: match positive + negative {
            0 => 1.0,
            decided => binomial_test(positive, decided, 0.5)?,
        },
    })
}

/// A median with a distribution-free interval.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Median {
    /// The median; the mean of the middle two for an even number.
    pub value: f64,
    /// The shortest pair of values, equally far from the ends, that covers the population's median at least as often as the confidence
    /// says; `None` if even the smallest and the largest value do not.
    pub ci: Option<[f64; 2]>,
    /// How often such a pair (or the smallest and the largest value) covers the population's median; more often if values are tied.
    pub coverage: f64,
}

/// The median of values, with an interval from their order.
///
/// Exact: the values at places k and n + 1 − k cover the median with probability 1 − 2 P(X < k), X binomial with n and 1/2.
/// Source: Hollander, Wolfe and Chicken 2014, ch. 3.6.
///
/// # Errors
/// No values or above 1e5, or one that is not finite; a confidence outside (0, 1).
pub fn median(values: &[f64], confidence: f64) -> Result<Median> {
    let n = values.len() as u64;
    check_counts(0, n)?;
    inner_probability("confidence", confidence)?;
    all_finite("value", values)?;
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let (lower, upper) = (sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2]);
    let coverage = |place: u64| 1.0 - 2.0 * binomial_upper_tail(n + 1 - place, n, 0.5);
    let places = (1..=n.div_ceil(2)).take_while(|place| coverage(*place) >= confidence);
    let place = places.last();
    let ci = place.map(|k| [sorted[k as usize - 1], sorted[(n - k) as usize]]);
    Ok(Median {
        value: 0.5 * (lower + upper),
        ci,
        coverage: coverage(place.unwrap_or(1)),
    })
}
