//! Shapiro and Wilk's test of normality.

use crate::tails::{normal_quantile, normal_tail};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_3, PI};

/// Result of Shapiro and Wilk's test.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ShapiroWilk {
    /// Squared correlation with the values of a normal sample; 1 for normal values.
    pub w: f64,
    /// Probability of a W as small in a normal sample.
    pub p: f64,
}

/// Tests whether values come from a normal distribution; `None` for fewer than 3 or more than 5000
/// values, equal values, or NaN.
///
/// Error: that of Royston's approximation, about 1 % of p for relevant p; the same as R's
/// `shapiro.test`. Source: Royston 1995, Applied Statistics 44, algorithm AS R94.
#[must_use]
pub fn shapiro_wilk(values: &[f64]) -> Option<ShapiroWilk> {
    let n = values.len();
    if !(3..=5000).contains(&n) || values.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let range = sorted[n - 1] - sorted[0];
    if range <= 0.0 {
        return None;
    }
    let mean = sorted.iter().sum::<f64>() / n as f64;
    let weights = weights(n);
    let pairs = weights.iter().zip(sorted.iter().zip(sorted.iter().rev()));
    let b: f64 = pairs.map(|(a, (low, high))| a * (high - low) / range).sum();
    let squares: f64 = sorted.iter().map(|v| ((v - mean) / range).powi(2)).sum();
    let w = (b * b / squares).min(1.0);
    Some(ShapiroWilk { w, p: p(w, n) })
}

fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Weights of the differences between largest and smallest, second largest and second smallest, ...
fn weights(n: usize) -> Vec<f64> {
    if n == 3 {
        return vec![FRAC_1_SQRT_2];
    }
    let count = n as f64;
    let score = |i: usize| normal_quantile((i as f64 + 1.0 - 0.375) / (count + 0.25));
    let mut m: Vec<f64> = (0..n / 2).map(|i| -score(i)).collect();
    let square = 2.0 * m.iter().map(|v| v * v).sum::<f64>();
    let x = count.sqrt().recip();
    let first = polynomial(
        &[
            0.0, 0.221_157, -0.147_981, -2.071_190, 4.434_685, -2.706_056,
        ],
        x,
    ) + m[0] / square.sqrt();
    let second = polynomial(
        &[
            0.0, 0.042_981, -0.293_762, -1.752_461, 5.682_633, -3.582_633,
        ],
        x,
    ) + m[1] / square.sqrt();
    // The outermost weights are fitted; the others share the rest of the unit length.
    let fitted: &[f64] = if n > 5 { &[first, second] } else { &[first] };
    let squares = |v: &[f64]| 2.0 * v.iter().map(|x| x * x).sum::<f64>();
    let left = (square - squares(&m[..fitted.len()])) / (1.0 - squares(fitted));
    m.iter_mut().for_each(|v| *v /= left.sqrt());
    m[..fitted.len()].copy_from_slice(fitted);
    m
}

fn p(w: f64, n: usize) -> f64 {
    if n == 3 {
        return (6.0 / PI * (w.sqrt().asin() - FRAC_PI_3)).clamp(0.0, 1.0);
    }
    let (count, ln_count) = (n as f64, (n as f64).ln());
    let y = (1.0 - w).ln();
    let (y, mean, ln_sd) = if n <= 11 {
        let gamma = 0.459 * count - 2.273;
        if y >= gamma {
            return 0.0;
        }
        (
            -(gamma - y).ln(),
            polynomial(&[0.5440, -0.399_78, 0.025_054, -6.714e-4], count),
            polynomial(&[1.3822, -0.778_57, 0.062_767, -0.002_032_2], count),
        )
    } else {
        (
            y,
            polynomial(&[-1.5861, -0.310_82, -0.083_751, 0.003_891_5], ln_count),
            polynomial(&[-0.4803, -0.082_676, 0.003_030_2], ln_count),
        )
    };
    normal_tail((y - mean) / ln_sd.exp())
}
