//! Quantiles of errors.

use std::fmt;

/// Summary of the magnitudes of a set of errors, for a test or a report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorStats {
    /// Number of errors, NaN included.
    pub count: usize,
    /// Half of the errors are at most this.
    pub median: f64,
    /// 99 % of the errors are at most this.
    pub q99: f64,
    /// The largest; NaN as soon as one error is NaN, so `max < bound` then fails.
    pub max: f64,
}

impl ErrorStats {
    /// From errors of either sign, by magnitude; NaN counts as the largest.
    ///
    /// Without any error, `count` is 0 and all figures are NaN.
    #[must_use]
    pub fn from_errors(errors: impl IntoIterator<Item = f64>) -> Self {
        // `abs` also clears the sign of a NaN, which `total_cmp` would otherwise sort first.
        let mut sorted: Vec<f64> = errors.into_iter().map(f64::abs).collect();
        sorted.sort_by(f64::total_cmp);
        Self {
            count: sorted.len(),
            median: quantile(&sorted, 0.5),
            q99: quantile(&sorted, 0.99),
            max: quantile(&sorted, 1.0),
        }
    }
}

impl FromIterator<f64> for ErrorStats {
    fn from_iter<I: IntoIterator<Item = f64>>(errors: I) -> Self {
        Self::from_errors(errors)
    }
}

impl fmt::Display for ErrorStats {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            count,
            median,
            q99,
            max,
        } = self;
        write!(
            f,
            "n {count}, median {median:.2e}, q99 {q99:.2e}, max {max:.2e}"
        )
    }
}

/// The `p` quantile of `sorted` (ascending), linear between neighbours.
///
/// NaN for an empty slice and for `p` outside `[0, 1]`.
///
/// Source: Hyndman and Fan 1996, definition 7.
#[must_use]
pub fn quantile(sorted: &[f64], p: f64) -> f64 {
    if sorted.is_empty() || !(0.0..=1.0).contains(&p) {
        return f64::NAN;
    }
    let place = p * (sorted.len() - 1) as f64;
    let low = sorted[place.floor() as usize];
    let high = sorted[place.ceil() as usize];
    // Equal neighbours may be infinite, where the difference would be NaN.
    if low == high {
        low
    } else {
        low + place.fract() * (high - low)
    }
}
