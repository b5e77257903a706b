//! Post hoc tests: comparisons of all pairs of levels after an analysis of variance.

use super::anova::{Design, ErrorModel, check_varies};
use super::art::{Aligner, equal_group_size};
use super::ratio::Ratio;
use crate::error::{PsychophysicsError, Result, inner_probability};
use crate::samples::{Wilcoxon, average_ranks, signed_rank_of};
use crate::study::{Factor, Study};
use crate::tails::{t_quantile_two_sided, t_tail_two_sided};

/// How a pair was tested.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum PairTest {
    /// t test of the subjects' differences.
    PairedT,
    /// Welch's t test of two groups of subjects.
    WelchT,
    /// t test of the mean difference against the pooled error of the analysis.
    PooledT,
}

/// Adjustment of p values for the number of comparisons.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Adjustment {
    /// Multiplies p by the number of comparisons.
    Bonferroni,
    /// Step-down, never above Bonferroni's: Holm 1979.
    #[default]
    Holm,
}

/// Two levels compared.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// The factor, or factors joined by colons.
    pub effect: String,
    /// The test.
    pub test: PairTest,
    /// Error model: the pair's own error, or the pooled error of the analysis.
    pub errors: ErrorModel,
    /// First level or combination, counted from 0.
    pub i: usize,
    /// Second level or combination, counted from 0.
    pub j: usize,
    /// Name of the first, combinations joined by colons.
    pub level_i: String,
    /// Name of the second.
    pub level_j: String,
    /// First minus second.
    pub mean_diff: f64,
    /// Lower end of the confidence interval of the difference, for this comparison alone.
    pub ci_low: f64,
    /// Upper end.
    pub ci_high: f64,
    /// `mean_diff` over its standard error.
    pub t: Ratio,
    /// Degrees of freedom; not whole for Welch's test.
    pub df: f64,
    /// Two-sided p of this comparison alone; `None` where t is undefined.
    pub p: Option<f64>,
    /// p by Bonferroni over all comparisons of the effect.
    pub p_bonferroni: Option<f64>,
    /// p by Holm over all comparisons of the effect.
    pub p_holm: Option<f64>,
    /// Mean difference over the standard deviation of the differences; `None` unless paired, or
    /// if all differences are the same.
    pub cohen_dz: Option<f64>,
    /// Wilcoxon's test of the pair; `None` unless paired, or if all differences are zero.
    pub wilcoxon: Option<Wilcoxon>,
}

impl Comparison {
    /// The p value adjusted for the number of comparisons.
    #[must_use]
    pub const fn p_adjusted(&self, how: Adjustment) -> Option<f64> {
        match how {
            Adjustment::Bonferroni => self.p_bonferroni,
            Adjustment::Holm => self.p_holm,
        }
    }
}

/// Compares all pairs of levels of a factor, or of combinations of several.
///
/// Each subject contributes its mean over all other factors. Tests pairs within subjects by paired
/// t tests, and pairs of groups by Welch's test. `confidence`: of the intervals, for instance 0.95.
///
/// Error: below 1e-9 relative against pingouin (tests/it/reference.rs).
///
/// # Errors
/// A factor that the study does not have; a confidence outside (0, 1); as [`anova`](super::anova()).
pub fn pairwise(study: &Study, factors: &[&str], confidence: f64) -> Result<Vec<Comparison>> {
    let compared = ComparedFactors::of(study, factors, confidence)?;
    Ok(compared.compare(study, study.values(), None))
}

/// Contrasts on aligned ranks (ART-C): pairs of levels, or of combinations of several factors.
///
/// The factors compared are treated as one factor with their combinations as levels. The values are
/// aligned for its main effect and ranked, because ranks aligned for another effect must not be compared.
/// `mean_diff` is in ranks. With strata, ranks are compared as in [`pairwise`]; with pooled errors,
/// against the pooled variation within subjects, as in a mixed model with an intercept for each subject.
///
/// Source of contrasts and alignment: Elkin et al. 2021, ART-C.
///
/// # Errors
/// As [`pairwise`]; groups of different size.
pub fn art_contrasts(
    study: &Study,
    factors: &[&str],
    errors: ErrorModel,
    confidence: f64,
) -> Result<Vec<Comparison>> {
    let compared = ComparedFactors::of(study, factors, confidence)?;
    let aligner = Aligner::of(study, equal_group_size(study)?);
    // All effects among the factors compared make up the main effect of their combination.
    let aligned = aligner.aligned(study, |mask| mask & !compared.mask == 0);
    let ranks = average_ranks(&aligned);
    let pooled = (errors == ErrorModel::Pooled).then(|| compared.design.test(&ranks, errors));
    let pooled = pooled.and_then(|effects| effects.into_iter().next_back());
    let pooled = pooled.map(|e| PooledError {
        mean_square: e.ss_error / e.df2 as f64,
        df: e.df2 as f64,
    });
    let mut pairs = compared.compare(study, &ranks, pooled);
    // A signed-rank test of differences of ranks adds no information.
    pairs.iter_mut().for_each(|p| p.wilcoxon = None);
    Ok(pairs)
}

/// The pooled error of an analysis.
#[derive(Clone, Copy)]
struct PooledError {
    mean_square: f64,
    df: f64,
}

/// Factors whose combinations are compared.
struct ComparedFactors {
    design: Design,
    mask: usize,
    name: String,
    /// Factors compared, as indices of those within subjects.
    within: Vec<usize>,
    /// Whether groups of subjects are compared too.
    groups: bool,
    confidence: f64,
}

/// The subjects' means in one of the combinations compared.
struct Sample {
    group: usize,
    name: String,
    values: Vec<f64>,
}

impl ComparedFactors {
    fn of(study: &Study, factors: &[&str], confidence: f64) -> Result<Self> {
        inner_probability("confidence", confidence)?;
        let design = Design::of(study)?;
        check_varies(study)?;
        let names: Vec<&str> = study.factors().map(|f| f.name.as_str()).collect();
        let mut mask = 0;
        for factor in factors {
            let place = names.iter().position(|n| n == factor);
            mask |= 1
                << place.ok_or_else(|| PsychophysicsError::UnknownFactor {
                    factor: (*factor).to_owned(),
                })?;
        }
        let found = design.effects().iter().find(|e| e.mask == mask);
        let name = found.map(|e| e.name.clone());
        let first = usize::from(study.between().is_some());
        Ok(Self {
            design,
            mask,
            name: name.ok_or(PsychophysicsError::Length {
                what: "factors to compare",
                got: 0,
                wanted: 1,
            })?,
            within: (0..study.within().len())
                .filter(|f| mask >> (f + first) & 1 == 1)
                .collect(),
            groups: first == 1 && mask & 1 == 1,
            confidence,
        })
    }

    fn compare(
        &self,
        study: &Study,
        values: &[f64],
        pooled: Option<PooledError>,
    ) -> Vec<Comparison> {
        let samples = self.samples(study, values);
        let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let mut quantiles: Vec<(f64, f64)> = Vec::new();
        let mut comparisons = Vec::with_capacity(samples.len() * (samples.len() - 1) / 2);
        for (i, a) in samples.iter().enumerate() {
            for (j, b) in samples.iter().enumerate().skip(i + 1) {
                let pair = match pooled {
                    Some(error) if a.group == b.group => {
                        PairStatistics::pooled(study, self, a, b, error)
                    }
                    _ if a.group == b.group => PairStatistics::paired(a, b, largest),
                    _ => PairStatistics::welch(a, b, largest),
                };
                // Nearly all pairs have the same degrees of freedom.
                let known = quantiles.iter().find(|(df, _)| *df == pair.df);
                let quantile = known.map(|(_, q)| *q).unwrap_or_else(|| {
                    let q = t_quantile_two_sided(1.0 - self.confidence, pair.df);
                    quantiles.push((pair.df, q));
                    q
                });
                let half = if pair.error > 0.0 {
                    quantile * pair.error
                } else {
                    0.0
                };
                let t = Ratio::of(pair.mean_diff, pair.error);
                comparisons.push(Comparison {
                    effect: self.name.clone(),
                    test: pair.test,
                    errors: match pair.test {
                        PairTest::PooledT => ErrorModel::Pooled,
                        PairTest::PairedT | PairTest::WelchT => ErrorModel::Strata,
                    },
                    i,
                    j,
                    level_i: a.name.clone(),
                    level_j: b.name.clone(),
                    mean_diff: pair.mean_diff,
                    ci_low: pair.mean_diff - half,
                    ci_high: pair.mean_diff + half,
                    t,
                    df: pair.df,
                    p: t.tail(|t| t_tail_two_sided(t, pair.df)),
                    p_bonferroni: None,
                    p_holm: None,
                    cohen_dz: pair.cohen_dz,
                    wilcoxon: pair.wilcoxon,
                });
            }
        }
        adjust(&mut comparisons);
        comparisons
    }

    fn samples(&self, study: &Study, values: &[f64]) -> Vec<Sample> {
        let own = self.within.iter().map(|&f| study.within()[f].clone());
        let factors: Vec<Factor> = own.collect();
        let combinations = Factor::combinations(&factors);
        let cells = study.cells();
        let combination = |cell: usize| {
            let levels = study.levels_of(cell);
            let own = self.within.iter().zip(&factors);
            own.fold(0, |sum, (&f, factor)| sum * factor.levels.len() + levels[f])
        };
        let of_cell: Vec<usize> = (0..cells).map(combination).collect();
        let groups = if self.groups {
            study.group_sizes().len()
        } else {
            1
        };
        let mut samples: Vec<Sample> = (0..groups * combinations)
            .map(|index| {
                let group = index / combinations;
                let levels = Factor::levels_at(&factors, index % combinations);
                let between = study.between().filter(|_| self.groups);
                let words = between.map(|between| between.factor.levels[group].as_str());
                let words: Vec<&str> = words
                    .into_iter()
                    .chain(levels.into_iter().flatten())
                    .collect();
                Sample {
                    group,
                    name: words.join(":"),
                    values: Vec::new(),
                }
            })
            .collect();
        let each = (cells / combinations) as f64;
        for (subject, row) in values.chunks_exact(cells).enumerate() {
            let group = if self.groups {
                study.group_of(subject)
            } else {
                0
            };
            let mut sums = vec![0.0; combinations];
            for (v, &c) in row.iter().zip(&of_cell) {
                sums[c] += v;
            }
            for (sample, sum) in samples[group * combinations..].iter_mut().zip(sums) {
                sample.values.push(sum / each);
            }
        }
        samples
    }
}

/// The statistics of one comparison, without its p value.
struct PairStatistics {
    test: PairTest,
    mean_diff: f64,
    /// Standard error of the difference; exactly zero if it would be only rounding.
    error: f64,
    df: f64,
    cohen_dz: Option<f64>,
    wilcoxon: Option<Wilcoxon>,
}

impl PairStatistics {
    fn paired(a: &Sample, b: &Sample, largest: f64) -> Self {
        let differences: Vec<f64> = a.values.iter().zip(&b.values).map(|(a, b)| a - b).collect();
        let (mean_diff, variance) = mean_and_variance(&differences, largest);
        let n = differences.len() as f64;
        Self {
            test: PairTest::PairedT,
            mean_diff,
            error: (variance / n).sqrt(),
            df: n - 1.0,
            cohen_dz: (variance > 0.0).then(|| mean_diff / variance.sqrt()),
            wilcoxon: signed_rank_of(&differences, largest),
        }
    }

    fn pooled(
        study: &Study,
        of: &ComparedFactors,
        a: &Sample,
        b: &Sample,
        error: PooledError,
    ) -> Self {
        let differences: Vec<f64> = a.values.iter().zip(&b.values).map(|(a, b)| a - b).collect();
        let (mean_diff, _) = mean_and_variance(&differences, 0.0);
        let factors = of.within.iter().map(|&f| study.within()[f].levels.len());
        let combinations: usize = factors.product();
        let averaged = (differences.len() * study.cells() / combinations) as f64;
        Self {
            test: PairTest::PooledT,
            mean_diff,
            error: (2.0 * error.mean_square / averaged).sqrt(),
            df: error.df,
            cohen_dz: None,
            wilcoxon: None,
        }
    }

    fn welch(a: &Sample, b: &Sample, largest: f64) -> Self {
        let side = |s: &Sample| {
            let (mean, variance) = mean_and_variance(&s.values, largest);
            (
                mean,
                variance / s.values.len() as f64,
                s.values.len() as f64 - 1.0,
            )
        };
        let ((mean_a, a, df_a), (mean_b, b, df_b)) = (side(a), side(b));
        let share = |v: f64, df: f64| if v > 0.0 { v * v / df } else { 0.0 };
        let spread = share(a, df_a) + share(b, df_b);
        Self {
            test: PairTest::WelchT,
            mean_diff: mean_a - mean_b,
            error: (a + b).sqrt(),
            df: if spread > 0.0 {
                (a + b).powi(2) / spread
            } else {
                df_a + df_b
            },
            cohen_dz: None,
            wilcoxon: None,
        }
    }
}

/// Mean and variance; the variance is exactly zero if rounding of values up to `largest` could explain it.
fn mean_and_variance(values: &[f64], largest: f64) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let floor = n * (8.0 * f64::EPSILON * largest).powi(2);
    let variance = if squares > floor {
        squares / (n - 1.0)
    } else {
        0.0
    };
    (mean, variance)
}

/// Fills in the p values adjusted for the number of comparisons.
fn adjust(comparisons: &mut [Comparison]) {
    let count = comparisons.len();
    let mut order: Vec<usize> = (0..count).filter(|&c| comparisons[c].p.is_some()).collect();
    order.sort_by(|&a, &b| {
        let p = |c: usize| comparisons[c].p.unwrap_or(1.0);
        p(a).total_cmp(&p(b))
    });
    let mut least = 0.0;
    for (before, c) in order.into_iter().enumerate() {
        let comparison = &mut comparisons[c];
        let times = |n: usize| comparison.p.map(|p| (p * n as f64).min(1.0));
        let holm = times(count - before).map(|p| p.max(least));
        least = holm.unwrap_or(least);
        comparison.p_bonferroni = times(count);
        comparison.p_holm = holm;
    }
}
