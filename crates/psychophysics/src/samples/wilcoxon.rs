//! Wilcoxon's signed-rank test of paired differences.

use super::ranks::{average_ranks, tie_sizes};
use crate::tails::normal_tail;

/// Differences up to which the exact distribution is used, as in R; its counts are exact in 64 bits.
const MOST_EXACT: usize = 49;

/// Wilcoxon's signed-rank test, two-sided.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Wilcoxon {
    /// Sum of the ranks of positive differences (R's V).
    pub rank_sum: f64,
    /// Differences that are not zero.
    pub count: usize,
    /// Probability of a rank sum at least as far from its mean.
    pub p: f64,
    /// Is `p` from the exact distribution?
    pub exact: bool,
    /// Rank-biserial correlation, −1 to 1: share of the ranks of positive differences minus the share of negative ones.
    pub rank_biserial: f64,
}

/// Tests whether differences are symmetric about zero; `None` if all are zero.
///
/// Zeros are dropped. With ties or zeros, or from 50 differences on, `p` is the normal approximation
/// with corrections for ties and continuity. Differences below 8 roundings (2⁻⁵²) of the largest
/// count as zero, and sizes closer than that as tied, such as 0.3 − 0.2 and 0.2 − 0.1.
///
/// Error: only rounding for the exact distribution, otherwise that of the normal approximation; the
/// same as R's `wilcox.test`. Source: Wilcoxon 1945; Kerby 2014 for the correlation.
#[must_use]
pub fn wilcoxon_signed_rank(differences: &[f64]) -> Option<Wilcoxon> {
    signed_rank_of(differences, largest(differences))
}

/// As [`wilcoxon_signed_rank`], but `p` is also exact with ties or zeros, for up to 49 differences that are not zero: it is the
/// share of all sign assignments of the given ranks. Use it for few ratings on a scale.
///
/// As R's `coin::wilcoxsign_test` with `distribution = "exact"` and `zero.method = "Wilcoxon"`.
#[must_use]
pub fn wilcoxon_signed_rank_exact(differences: &[f64]) -> Option<Wilcoxon> {
    test_of(differences, largest(differences), true)
}

fn largest(differences: &[f64]) -> f64 {
    differences.iter().fold(0.0, |m: f64, d| m.max(d.abs()))
}

/// As [`wilcoxon_signed_rank`] for differences of values up to `largest` in size; the differences contain the rounding errors of these
/// values.
pub(crate) fn signed_rank_of(differences: &[f64], largest: f64) -> Option<Wilcoxon> {
    test_of(differences, largest, false)
}

fn test_of(differences: &[f64], largest: f64, exact_ties: bool) -> Option<Wilcoxon> {
    if differences.iter().any(|d| d.is_nan()) {
        return None;
    }
    // Infinite differences can be ranked, but have no rounding.
    let floor = if largest.is_finite() {
        8.0 * f64::EPSILON * largest
    } else {
        0.0
    };
    let kept = differences.iter().copied().filter(|d| d.abs() > floor);
    let kept: Vec<f64> = kept.collect();
    if kept.is_empty() {
        return None;
    }
    let sizes = without_rounding(&kept, floor);
    let ranks = average_ranks(&sizes);
    let rank_sum: f64 = kept
        .iter()
        .zip(&ranks)
        .filter(|(d, _)| **d > 0.0)
        .map(|(_, r)| r)
        .sum();
    let n = kept.len() as f64;
    let total = 0.5 * n * (n + 1.0);
    let ties = tie_sizes(&sizes);
    let distinct = kept.len() == differences.len() && ties.iter().all(|t| *t == 1);
    let exact = kept.len() <= MOST_EXACT && (distinct || exact_ties);
    let p = if exact {
        // Twice the mean ranks are whole numbers.
        let doubled: Vec<usize> = ranks.iter().map(|r| (2.0 * r) as usize).collect();
        let smaller = (2.0 * rank_sum.min(total - rank_sum)) as usize;
        2.0 * signings(&doubled, smaller).iter().sum::<f64>() / 2_f64.powi(kept.len() as i32)
    } else {
        let ties: f64 = ties.iter().map(|&t| (t * t * t - t) as f64).sum();
        let variance = n * (n + 1.0) * (2.0 * n + 1.0) / 24.0 - ties / 48.0;
        let off = (rank_sum - 0.5 * total).abs() - 0.5;
        2.0 * normal_tail(off.max(0.0) / variance.sqrt())
    };
    Some(Wilcoxon {
        rank_sum,
        count: kept.len(),
        p: p.min(1.0),
        exact,
        rank_biserial: 2.0 * rank_sum / total - 1.0,
    })
}

/// Absolute differences; those no further apart than `floor` become equal.
fn without_rounding(differences: &[f64], floor: f64) -> Vec<f64> {
    let mut sizes: Vec<f64> = differences.iter().map(|d| d.abs()).collect();
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_unstable_by(|&a, &b| sizes[a].total_cmp(&sizes[b]));
    let (mut last, mut shared) = (f64::NEG_INFINITY, 0.0);
    for i in order {
        let size = sizes[i];
        if size - last > floor {
            shared = size;
        }
        sizes[i] = shared;
        last = size;
    }
    sizes
}

/// For each sum from 0 to `most`: the number of sign assignments in which the positive ones of these ranks have this sum.
pub(crate) fn signings(ranks: &[usize], most: usize) -> Vec<f64> {
    let mut ways = vec![0.0; most + 1];
    ways[0] = 1.0;
    for &rank in ranks {
        for sum in (rank..=most).rev() {
            ways[sum] += ways[sum - rank];
        }
    }
    ways
}
