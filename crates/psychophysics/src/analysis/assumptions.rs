//! Checks of the tests' assumptions: normal residuals, symmetric and continuous values.

use super::anova::{Effect, ErrorModel};
use crate::numbers::probability;
use crate::samples::{ShapiroWilk, shapiro_wilk, tie_sizes};
use crate::study::Study;

/// Skewness of the residuals, of either sign, above which aligned ranks are not reliable.
const MOST_SKEWED: f64 = 1.0;
/// Probability of two equal values above which values count as discrete; equals that of 20 equally
/// frequent values.
const MOST_TIED: f64 = 0.05;
/// p below which normality or sphericity is rejected.
const DOUBT: f64 = 0.05;

/// A warning to readers of the results.
#[derive(Debug, Clone, PartialEq, serde::Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what the fields hold")]
pub enum Warning {
    /// Residuals are skewed (third standardised moment): aligned ranks then give false effects (Luepsen 2017,
    /// Tsandilas and Casiez 2024). For magnitude estimates, use logarithms or the geometric normalisation.
    #[error("residuals are skewed ({skewness:.2}), aligned ranks find effects that are not there")]
    Skewed { skewness: f64 },
    /// Few different values (two are equal with probability `tied`): aligned ranks then give false effects.
    #[error(
        "{values} values are only {distinct} different ones, aligned ranks find effects that are not there"
    )]
    Discrete {
        distinct: usize,
        values: usize,
        tied: f64,
    },
    /// Residuals are not normal (Shapiro and Wilk's test); F is robust against this, its p less so.
    #[error("residuals are not normal (p = {})", probability(Some(*p)))]
    NotNormal { p: f64 },
    /// Mauchly's test rejects sphericity of an effect: use `p_gg` or `p_hf`, not `p`.
    #[error(
        "{effect} is not spherical (Mauchly's p = {}), read its corrected p (GG ε = {gg:.3})",
        probability(Some(*p))
    )]
    NotSpherical { effect: String, p: f64, gg: f64 },
    /// Effects are tested against pooled errors, but their own errors differ in size (`ratio`: largest to smallest mean
    /// square). p is then too small for effects with the larger errors.
    #[error(
        "the errors that are pooled differ {ratio:.1} times in mean square, p of the noisier effects is too small"
    )]
    PooledUnequal { ratio: f64 },
}

/// Diagnostics of a study.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Assumptions {
    /// Normality of the residuals; `None` without residuals or with more than 5000.
    pub normality: Option<ShapiroWilk>,
    /// Third standardised moment of the residuals; `None` where they are all zero.
    pub skewness: Option<f64>,
    /// Number of different values.
    pub distinct: usize,
    /// Probability that two values, drawn without replacement, are equal.
    pub tied: f64,
}

impl Assumptions {
    /// Diagnoses the residuals `y − ȳ_cell − ȳ_subject + ȳ` within groups, and ties among the answers `given`
    /// before scaling: scaling each subject makes equal answers differ. Without scaling
    /// both arguments are the same study.
    #[must_use]
    pub fn of(study: &Study, given: &Study) -> Self {
        let residuals = residuals(study);
        let n = residuals.len() as f64;
        let moment = |k: i32| residuals.iter().map(|r| r.powi(k)).sum::<f64>() / n;
        let largest = study.values().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let variance = moment(2);
        let varies = variance > (8.0 * f64::EPSILON * largest).powi(2);
        let ties = tie_sizes(given.values());
        let pairs: f64 = ties.iter().map(|&t| (t * (t - 1)) as f64).sum();
        Self {
            normality: varies.then(|| shapiro_wilk(&residuals)).flatten(),
            skewness: varies.then(|| moment(3) / variance.powf(1.5)),
            distinct: ties.len(),
            tied: pairs / (n * (n - 1.0)),
        }
    }

    /// Warnings that aligned ranks have an increased type I error rate.
    pub(super) fn against_aligned_ranks(&self, values: usize) -> Vec<Warning> {
        let mut warnings = Vec::new();
        if let Some(skewness) = self.skewness.filter(|s| s.abs() > MOST_SKEWED) {
            warnings.push(Warning::Skewed { skewness });
        }
        if self.tied > MOST_TIED {
            warnings.push(Warning::Discrete {
                distinct: self.distinct,
                values,
                tied: self.tied,
            });
        }
        warnings
    }

    /// Warnings about the analysis of variance with the error models of `effects`.
    pub(super) fn against_anova(&self, effects: &[Effect]) -> Vec<Warning> {
        let mut warnings = Vec::new();
        if let Some(test) = self.normality.filter(|t| t.p < DOUBT) {
            warnings.push(Warning::NotNormal { p: test.p });
        }
        let strata = || effects.iter().filter(|e| e.errors == ErrorModel::Strata);
        for effect in strata() {
            if let (Some(m), Some(gg)) = (effect.mauchly.filter(|m| m.p < DOUBT), effect.gg) {
                let effect = effect.name.clone();
                warnings.push(Warning::NotSpherical { effect, p: m.p, gg });
            }
        }
        warnings
    }
}

/// A warning if the pooled errors differ in size; `strata`: the same study tested in strata.
pub(super) fn pooled_unequal(strata: &[Effect]) -> Option<Warning> {
    let within = strata.iter().filter(|e| e.gg.is_some());
    let squares: Vec<f64> = within.map(|e| e.ss_error / e.df2 as f64).collect();
    let largest = squares.iter().copied().fold(0.0, f64::max);
    let smallest = squares.iter().copied().fold(f64::INFINITY, f64::min);
    let ratio = largest / smallest;
    (squares.len() > 1 && ratio > 2.0 && ratio.is_finite())
        .then_some(Warning::PooledUnequal { ratio })
}

/// Values without the means of cells and subjects.
fn residuals(study: &Study) -> Vec<f64> {
    let cells = study.cells();
    let sizes = study.group_sizes();
    let mut cell_means = vec![0.0; cells * sizes.len()];
    for (subject, row) in study.rows().enumerate() {
        let group = study.group_of(subject);
        for (mean, v) in cell_means[group * cells..].iter_mut().zip(row) {
            *mean += v / sizes[group] as f64;
        }
    }
    let rows = study.rows().enumerate();
    rows.flat_map(|(subject, row)| {
        let means = &cell_means[study.group_of(subject) * cells..][..cells];
        let off = row.iter().zip(means).map(|(v, m)| v - m);
        // A subject with a single value has no scatter of its own.
        let own = match cells {
            1 => 0.0,
            _ => off.clone().sum::<f64>() / cells as f64,
        };
        off.map(move |v| v - own).collect::<Vec<_>>()
    })
    .collect()
}
