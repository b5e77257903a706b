//! Aligned rank transform: rank analysis that preserves interactions.

use super::anova::{Design, Effect, ErrorModel, check_varies};
use crate::error::{PsychophysicsError, Result};
use crate::samples::average_ranks;
use crate::study::Study;

/// One effect, tested on the ranks of values aligned for it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ArtEffect {
    /// The test, of ranks.
    #[serde(flatten)]
    pub effect: Effect,
    /// Sum of the aligned values, relative to the sum of their absolute values: 0 except for rounding.
    pub aligned_sum: f64,
    /// Largest F of the other effects on the aligned values: 0 except for rounding, unless the alignment failed.
    pub largest_other_f: f64,
}

/// Non-parametric factorial analysis: aligned rank transform, with one full analysis per effect.
///
/// For each effect, all other fixed effects are removed from the values (subtract the cell mean, add the
/// estimated effect). The aligned values are rounded to 8 decimal places, ranked over all subjects and
/// analysed; only this effect of the analysis is used. Differences between subjects are not removed.
///
/// Its type I error rate is right only for roughly symmetric and continuous values:
/// [`Assumptions`](super::Assumptions) warns otherwise.
///
/// Error: below 1e-9 relative against R's ARTool 0.11.2 (tests/it/reference.rs).
/// Source: Higgins, Blair and Tashtoush 1990; Wobbrock et al. 2011.
///
/// # Errors
/// As [`anova`](super::anova())'s; groups of different size.
pub fn aligned_rank_transform(study: &Study, errors: ErrorModel) -> Result<Vec<ArtEffect>> {
    let design = Design::of(study)?;
    check_varies(study)?;
    let aligner = Aligner::of(study, equal_group_size(study)?);
    let effects = design.effects().iter().enumerate();
    let tested = effects.map(|(index, named)| {
        let aligned = aligner.aligned(study, |mask| mask == named.mask);
        let others = design.test(&aligned, errors).into_iter().enumerate();
        let others = others.filter(|(i, _)| *i != index);
        let others = others.filter_map(|(_, e)| e.f.finite());
        let sizes: f64 = aligned.iter().map(|v| v.abs()).sum();
        let sum: f64 = aligned.iter().sum();
        let ranks = average_ranks(&aligned);
        ArtEffect {
            effect: design.test(&ranks, errors).swap_remove(index),
            aligned_sum: if sizes > 0.0 { sum / sizes } else { 0.0 },
            largest_other_f: others.fold(0.0, f64::max),
        }
    });
    Ok(tested.collect())
}

/// The number of subjects in every group.
///
/// # Errors
/// Groups of different size.
pub(super) fn equal_group_size(study: &Study) -> Result<usize> {
    let group_sizes = study.group_sizes();
    let smallest = group_sizes.iter().copied().min().unwrap_or(0);
    let largest = group_sizes.iter().copied().max().unwrap_or(0);
    if smallest != largest {
        return Err(PsychophysicsError::UnequalGroups { smallest, largest });
    }
    Ok(largest)
}

/// Means of all combinations of levels, groups included, for aligning values.
pub(crate) struct Aligner {
    /// Levels of every factor, that between subjects first.
    sizes: Vec<usize>,
    /// Mean of every combination over its subjects.
    means: Vec<f64>,
    digits: i32,
}

impl Aligner {
    /// `group_size`: the number of subjects in every group, see [`equal_group_size`].
    pub(crate) fn of(study: &Study, group_size: usize) -> Self {
        let cells = study.cells();
        let mut means = vec![0.0; cells * study.group_sizes().len()];
        for (subject, row) in study.rows().enumerate() {
            let own = &mut means[study.group_of(subject) * cells..][..cells];
            for (mean, v) in own.iter_mut().zip(row) {
                *mean += v;
            }
        }
        means.iter_mut().for_each(|m| *m /= group_size as f64);
        let size = study.values().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        // This rounding makes values equal that differ only by rounding errors. The published 8
        // digits suit values near one; very small or large values need others.
        let digits = match size.log10().floor() {
            order @ (..-2.0 | 6.0..) if order.is_finite() => 10 - order as i32,
            _ => 8,
        };
        Self {
            sizes: study.factors().map(|f| f.levels.len()).collect(),
            means,
            digits,
        }
    }

    /// Values minus their cell mean, plus the estimated effects that are `kept` (by mask).
    pub(crate) fn aligned(&self, study: &Study, kept: impl Fn(usize) -> bool) -> Vec<f64> {
        let mut put_back = vec![0.0; self.means.len()];
        for mask in (1..1 << self.sizes.len()).filter(|m| kept(*m)) {
            for (sum, e) in put_back.iter_mut().zip(self.effect(mask)) {
                *sum += e;
            }
        }
        let cells = study.cells();
        let scale = 10_f64.powi(self.digits);
        let rows = study.rows().enumerate();
        let aligned = rows.flat_map(|(subject, row)| {
            let at = study.group_of(subject) * cells;
            let (means, effects) = (&self.means[at..], &put_back[at..]);
            let parts = row.iter().zip(means).zip(effects);
            parts.map(|((v, mean), effect)| ((v - mean + effect) * scale).round() / scale)
        });
        aligned.collect()
    }

    /// Estimated effect: deviation from the mean over the factors in `mask`, mean over the others.
    fn effect(&self, mask: usize) -> Vec<f64> {
        let mut table = self.means.clone();
        let mut stride = table.len();
        for (factor, &k) in self.sizes.iter().enumerate() {
            stride /= k;
            let keep = mask >> factor & 1 == 1;
            for start in (0..table.len()).step_by(stride * k) {
                for first in start..start + stride {
                    let line = || (0..k).map(|j| first + j * stride);
                    let mean = line().map(|i| table[i]).sum::<f64>() / k as f64;
                    for i in line() {
                        table[i] = if keep { table[i] - mean } else { mean };
                    }
                }
            }
        }
        table
    }
}
