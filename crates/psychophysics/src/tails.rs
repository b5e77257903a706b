//! Tail probabilities with full relative accuracy down to 1e-300 and below.
//!
//! The prefactor of the incomplete beta function is computed as a logarithm from both `x` and `1 − x`:
//! computing one of them from the other, as statrs does, loses digits in thin tails. The error
//! function comes from libm, because that of statrs has only eleven correct digits.

use libm::{erfc, lgamma as ln_gamma};
use statrs::function::erf::erfc_inv;
use statrs::function::gamma::gamma_ur;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2, TAU};

/// `P(F > f)` with `df1`, `df2` degrees of freedom, which need not be whole numbers.
///
/// Error: below 1e-11 relative down to 1e-300 (tests/it/tails.rs). NaN for degrees of freedom that are not above zero.
/// Source: `I_x(df2/2, df1/2)`, `x = df2 / (df2 + df1 f)`, Abramowitz and Stegun 26.6.2.
#[must_use]
pub fn f_tail(f: f64, df1: f64, df2: f64) -> f64 {
    if f.is_nan() || !(df1 > 0.0 && df2 > 0.0) {
        return f64::NAN;
    }
    if f <= 0.0 {
        return 1.0;
    }
    // Both x and 1 − x keep their digits.
    let ratio = df1 * f / df2;
    let (ln_x, ln_y) = if ratio.is_infinite() {
        return 0.0;
    } else {
        (-ratio.ln_1p(), -ratio.recip().ln_1p())
    };
    // With huge degrees of freedom the result may exceed the range by rounding; NaN stays.
    incomplete_beta(0.5 * df2, 0.5 * df1, ln_x, ln_y).clamp(0.0, 1.0)
}

/// `P(|T| > |t|)` with `df` degrees of freedom, two-sided.
///
/// Error: as [`f_tail`].
#[must_use]
pub fn t_tail_two_sided(t: f64, df: f64) -> f64 {
    f_tail(t * t, 1.0, df)
}

/// The `t` for which `P(|T| > t)` is `p`.
///
/// Error: below 1e-12 relative. NaN unless `0 < p < 1` and `df > 0`.
#[must_use]
pub fn t_quantile_two_sided(p: f64, df: f64) -> f64 {
    if !(p > 0.0 && p < 1.0 && df > 0.0) {
        return f64::NAN;
    }
    // ln P falls more and more steeply with ln t, so Newton's method on the logarithms converges from below.
    let ln_constant = ln_gamma(0.5 * (df + 1.0)) - ln_gamma(0.5 * df) - 0.5 * (0.5 * df * TAU).ln();
    let mut t = normal_quantile(1.0 - 0.5 * p).max(1e-8);
    if !t.is_finite() {
        t = 8.0;
    }
    for _ in 0..200 {
        let tail = t_tail_two_sided(t, df);
        let density = 2.0 * (ln_constant - 0.5 * (df + 1.0) * (t * t / df).ln_1p()).exp();
        let step = (tail.ln() - p.ln()) * tail / (density * t);
        if !step.is_finite() {
            return f64::NAN;
        }
        t *= step.clamp(-2.0, 2.0).exp();
        if step.abs() < 1e-15 {
            break;
        }
    }
    t
}

/// `P(χ² > x)` with `df` degrees of freedom.
///
/// Error: below 1e-11 relative down to 1e-300 for up to 1e4 degrees of freedom, then growing with them, to 1e-6 at
/// 1e8. NaN for degrees of freedom below 1e-6 or above 1e8, for which the continued fraction does not terminate.
#[must_use]
pub fn chi2_tail(x: f64, df: f64) -> f64 {
    if x.is_nan() || !(1e-6..=1e8).contains(&df) {
        f64::NAN
    } else if 0.5 * x <= 0.0 {
        1.0
    } else if x.is_infinite() {
        0.0
    } else {
        gamma_ur(0.5 * df, 0.5 * x)
    }
}

/// `P(X >= k)` of a binomial variable with `n` trials and probability `p` in (0, 1).
///
/// Error: as [`f_tail`]. Source: `I_p(k, n - k + 1)`, Abramowitz and Stegun 26.5.24.
pub(crate) fn binomial_upper_tail(k: u64, n: u64, p: f64) -> f64 {
    if k == 0 {
        return 1.0;
    }
    if k > n {
        return 0.0;
    }
    incomplete_beta(k as f64, (n - k + 1) as f64, p.ln(), (-p).ln_1p()).clamp(0.0, 1.0)
}

/// Logarithm of the number of ways to choose `k` of `n`.
pub(crate) fn ln_choose(n: u64, k: u64) -> f64 {
    ln_gamma(n as f64 + 1.0) - ln_gamma(k as f64 + 1.0) - ln_gamma((n - k) as f64 + 1.0)
}

/// `P(Z > z)` of the standard normal distribution.
#[must_use]
pub fn normal_tail(z: f64) -> f64 {
    0.5 * erfc(z * FRAC_1_SQRT_2)
}

/// `P(Z < z)` of the standard normal distribution.
#[must_use]
pub fn normal_cdf(z: f64) -> f64 {
    normal_tail(-z)
}

/// `P(F < f)` of the noncentral F distribution with `df1`, `df2` degrees of freedom and noncentrality `lambda`.
///
/// A sum over Poisson weights of `I_x(df1/2 + j, df2/2)`, from the largest weight to both sides.
/// Error: below 1e-10. NaN for degrees of freedom outside 1e-6 to 1e6 or a noncentrality outside 0 to 1e6, where sums
/// get long.
/// Source: Johnson, Kotz and Balakrishnan 1995, ch. 30.
#[must_use]
pub fn noncentral_f_cdf(f: f64, df1: f64, df2: f64, lambda: f64) -> f64 {
    if f.is_nan() || ![df1, df2].iter().all(is_countable) || !(0.0..=1e6).contains(&lambda) {
        return f64::NAN;
    }
    if f <= 0.0 {
        return 0.0;
    }
    let ratio = df1 * f / df2;
    if ratio.is_infinite() {
        return 1.0;
    }
    // ln x and ln (1 - x) of x = df1 f / (df2 + df1 f).
    let (ln_x, ln_y) = (-ratio.recip().ln_1p(), -ratio.ln_1p());
    let beta = |j: f64| incomplete_beta(0.5 * df1 + j, 0.5 * df2, ln_x, ln_y);
    poisson_mean(0.5 * lambda, beta).clamp(0.0, 1.0)
}

/// `P(T < t)` of the noncentral t distribution with `df` degrees of freedom and noncentrality `delta`.
///
/// Error: below 1e-10. NaN for degrees of freedom outside 1e-6 to 1e6 or a noncentrality that is not finite or beyond
/// 1000, where sums get long.
/// Source: Johnson, Kotz and Balakrishnan 1995, ch. 31; Lenth 1989.
#[must_use]
pub fn noncentral_t_cdf(t: f64, df: f64, delta: f64) -> f64 {
    if t.is_nan() || !is_countable(&df) || delta.is_nan() || delta.abs() > 1000.0 {
        return f64::NAN;
    }
    if t < 0.0 {
        return 1.0 - noncentral_t_cdf(-t, df, -delta);
    }
    let ratio = t * t / df;
    let below = normal_cdf(-delta);
    if ratio == 0.0 {
        return below;
    }
    if ratio.is_infinite() {
        return 1.0;
    }
    let (ln_x, ln_y) = (-ratio.recip().ln_1p(), -ratio.ln_1p());
    let mean = 0.5 * delta * delta;
    let even = poisson_mean(mean, |j| incomplete_beta(j + 0.5, 0.5 * df, ln_x, ln_y));
    // The odd terms have the weights e^-m m^(j + 1/2) / Γ(j + 3/2).
    let odd = weighted_mean(mean, 0.5, |j| {
        incomplete_beta(j + 1.0, 0.5 * df, ln_x, ln_y)
    });
    let odd = odd * delta.signum();
    (below + 0.5 * (even + odd)).clamp(0.0, 1.0)
}

/// Are these degrees of freedom for which sums are short?
fn is_countable(df: &f64) -> bool {
    (1e-6..=1e6).contains(df)
}

/// The mean of a bounded function of a Poisson variable.
fn poisson_mean(mean: f64, of: impl Fn(f64) -> f64) -> f64 {
    weighted_mean(mean, 0.0, of)
}

/// `Σ e^-m m^(j + s) / Γ(j + s + 1) f(j)` over j from 0: terms beyond 12 standard deviations are negligible.
fn weighted_mean(mean: f64, shift: f64, of: impl Fn(f64) -> f64) -> f64 {
    if mean == 0.0 {
        return if shift == 0.0 { of(0.0) } else { 0.0 };
    }
    let reach = 12.0 * mean.sqrt() + 40.0;
    let (first, last) = ((mean - reach).max(0.0).floor(), (mean + reach).ceil());
    let mut sum = 0.0;
    let mut j = first;
    while j <= last {
        let k = j + shift;
        let ln_weight = k * mean.ln() - mean - ln_gamma(k + 1.0);
        let weight = ln_weight.exp();
        if weight > 1e-18 {
            sum += weight * of(j);
        }
        j += 1.0;
    }
    sum
}

/// The `z` below which a standard normal variable lies with probability `p`; infinite at 0 and 1, NaN
/// outside.
#[must_use]
pub fn normal_quantile(p: f64) -> f64 {
    if !(0.0..=1.0).contains(&p) {
        return f64::NAN;
    }
    let z = -SQRT_2 * erfc_inv(2.0 * p);
    let density = (-0.5 * z * z).exp() / TAU.sqrt();
    // One Newton step adds the digits that erfc_inv lacks.
    let step = (normal_cdf(z) - p) / density;
    if step.is_finite() { z - step } else { z }
}

/// `I_x(a, b)` from `ln x` and `ln (1 − x)`.
fn incomplete_beta(a: f64, b: f64, ln_x: f64, ln_y: f64) -> f64 {
    let (x, y) = (ln_x.exp(), ln_y.exp());
    // The fraction converges fast on this side of the mean. On the other side, use the complement: it is not small,
    // so nothing cancels.
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - beta_fraction(b, a, y, ln_y, ln_x);
    }
    beta_fraction(a, b, x, ln_x, ln_y)
}

/// Lentz's method for the continued fraction of `I_x(a, b)`, Abramowitz and Stegun 26.5.8.
fn beta_fraction(a: f64, b: f64, x: f64, ln_x: f64, ln_y: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let kept = |v: f64| if v.abs() < TINY { TINY } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / kept(1.0 - (a + b) * x / (a + 1.0));
    let mut fraction = d;
    // Needs about √max(a, b) terms.
    for m in 1..100_000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / kept(1.0 + even * d);
        c = kept(1.0 + even / c);
        fraction *= d * c;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / kept(1.0 + odd * d);
        c = kept(1.0 + odd / c);
        fraction *= d * c;
        if (d * c - 1.0).abs() < 1e-16 {
            break;
        }
    }
    let ln_beta = ln_gamma(a) + ln_gamma(b) - ln_gamma(a + b);
    (a * ln_x + b * ln_y - ln_beta).exp() * fraction / a
}
