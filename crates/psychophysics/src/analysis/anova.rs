//! Repeated-measures analysis of variance, with or without a factor between subjects.
//!
//! For an effect within subjects with d orthonormal contrasts, let `z_s` be the contrasts of subject
//! s, `z̄_g` their mean over the `n_g` subjects of group g, with N subjects in G groups. Then
//!
//! - the effect has `SS = h |mean_g z̄_g|²`, `h = G² / Σ 1/n_g`, on d degrees of freedom,
//! - its interaction with the groups has `SS = Σ n_g |z̄_g − z̄|²` on d (G − 1),
//! - both are tested against `SS = Σ |z_s − z̄_g|²` on d (N − G); sphericity is a property of the
//!   covariance of `z` within groups.
//!
//! The mean is an effect with d = 1: its interaction with the groups is the effect between subjects.

use super::contrasts::Contrasts;
use super::ratio::Ratio;
use super::sphericity::{Covariance, Mauchly, Sphericity};
use crate::error::{PsychophysicsError, Result};
use crate::study::Study;
use crate::tails::f_tail;

/// Error term for effects within subjects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ErrorModel {
    /// Tests every effect against its own interaction with the subjects: A on S:A, B on S:B, A:B on S:A:B.
    ///
    /// R's `aov(y ~ A*B + Error(S/(A*B)))`, statsmodels' `AnovaRM`. Needs sphericity only within
    /// each effect, for which it can be corrected.
    #[default]
    Strata,
    /// Tests all effects against the whole variation within subjects.
    ///
    /// R's `aov(y ~ A*B + Error(S))`. Its many degrees of freedom are right only if subjects differ
    /// just by a constant. The dissertation's table is of this kind (df 4, 576).
    Pooled,
}

/// One effect tested.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Effect {
    /// Factors of the effect, joined by colons: `a:b`.
    pub name: String,
    /// Error model it is tested with.
    pub errors: ErrorModel,
    /// Sum of squares.
    pub ss: f64,
    /// Sum of squares of the error.
    pub ss_error: f64,
    /// Degrees of freedom.
    pub df1: usize,
    /// Degrees of freedom of the error.
    pub df2: usize,
    /// `(ss / df1) / (ss_error / df2)`.
    pub f: Ratio,
    /// Probability of an F as large without an effect; `None` where F is undefined.
    pub p: Option<f64>,
    /// `ss / (ss + ss_error)`; `None` where both are zero.
    pub partial_eta2: Option<f64>,
    /// `ss / (ss + all error, including that between subjects)`, equal for both error models:
    /// Olejnik and Algina 2003 for manipulated factors.
    pub generalized_eta2: Option<f64>,
    /// Greenhouse and Geisser's ε; `None` for pooled errors and effects between subjects.
    pub gg: Option<f64>,
    /// Huynh and Feldt's ε.
    pub hf: Option<f64>,
    /// p with both degrees of freedom times `gg`.
    pub p_gg: Option<f64>,
    /// p with both degrees of freedom times `hf`.
    pub p_hf: Option<f64>,
    /// Mauchly's test of sphericity; `None` also if the error is only rounding.
    pub mauchly: Option<Mauchly>,
    /// Which factors: bit f for the f-th of [`Study::factors`].
    #[serde(skip)]
    mask: usize,
}

/// All effects of a study: main effects first, then interactions by size.
///
/// Sums of squares are of type III; with equal groups all types agree. `ss_error` of effects between
/// subjects is the variation of the subjects' means within groups.
///
/// Error: below 1e-9 relative against R, pingouin and statsmodels (tests/it/reference.rs). Sums of
/// squares no larger than rounding of the data count as zero.
/// Source: Winer, Brown and Michels 1991, ch. 4 and 7; computed by orthonormal contrasts.
///
/// # Errors
/// Fewer than two subjects in total or in a group; all values the same.
pub fn anova(study: &Study, errors: ErrorModel) -> Result<Vec<Effect>> {
    let design = Design::of(study)?;
    check_varies(study)?;
    Ok(design.test(study.values(), errors))
}

pub(super) fn check_varies(study: &Study) -> Result<()> {
    let values = study.values();
    if values.iter().any(|v| *v != values[0]) {
        return Ok(());
    }
    Err(PsychophysicsError::Constant {
        count: values.len(),
        value: values[0],
    })
}

/// An effect of a design.
#[derive(Debug, Clone)]
pub(crate) struct NamedEffect {
    /// Which factors: bit f for the f-th of [`Study::factors`].
    pub(crate) mask: usize,
    /// `a:b`.
    pub(crate) name: String,
}

/// The design of a study, for analyses of many sets of values.
#[derive(Debug, Clone)]
pub(crate) struct Design {
    contrasts: Contrasts,
    cells: usize,
    group_of: Vec<usize>,
    group_sizes: Vec<usize>,
    has_groups: bool,
    /// In the order of reports.
    effects: Vec<NamedEffect>,
}

/// Sums of squares of the coefficients of one effect within subjects.
struct Stratum {
    /// Sum of squares of the mean over groups.
    ss: f64,
    /// Sum of squares of the differences between groups.
    ss_groups: f64,
    /// Sum of squares of the subjects within groups.
    ss_error: f64,
    df: usize,
    df_error: usize,
    sphericity: Option<Sphericity>,
}

impl Design {
    pub(crate) fn of(study: &Study) -> Result<Self> {
        let group_sizes = study.group_sizes();
        let got = group_sizes.iter().copied().min().unwrap_or(0);
        if got < 2 {
            return Err(PsychophysicsError::TooFewSubjects { got, wanted: 2 });
        }
        let sizes: Vec<usize> = study.within().iter().map(|f| f.levels.len()).collect();
        let names: Vec<&str> = study.factors().map(|f| f.name.as_str()).collect();
        let mut masks: Vec<usize> = (1..1 << names.len()).collect();
        // Sort by the number of factors, then by the first factors, which have the lowest bits.
        masks.sort_by_key(|m| (m.count_ones(), usize::MAX - m.reverse_bits()));
        let name = |mask: usize| {
            let own = (0..names.len()).filter(|i| mask >> i & 1 == 1);
            own.map(|i| names[i]).collect::<Vec<_>>().join(":")
        };
        Ok(Self {
            contrasts: Contrasts::new(&sizes),
            cells: study.cells(),
            group_of: (0..study.subjects().len())
                .map(|s| study.group_of(s))
                .collect(),
            group_sizes,
            has_groups: study.between().is_some(),
            effects: masks
                .into_iter()
                .map(|mask| NamedEffect {
                    mask,
                    name: name(mask),
                })
                .collect(),
        })
    }

    /// All effects, in the order of [`Design::test`].
    pub(crate) fn effects(&self) -> &[NamedEffect] {
        &self.effects
    }

    /// Tests all effects on values of this design.
    pub(crate) fn test(&self, values: &[f64], errors: ErrorModel) -> Vec<Effect> {
        let floor = rounding_floor(values);
        let mut strata = self.strata(values, errors == ErrorModel::Strata);
        // A covariance of rounding errors says nothing about the subjects.
        for stratum in strata.iter_mut().filter(|s| s.ss_error <= floor) {
            stratum.sphericity = stratum.sphericity.map(|_| Sphericity::WITHOUT_ERROR);
        }
        let all_error: f64 = strata.iter().map(|s| s.ss_error).sum();
        let within = || strata.iter().skip(1);
        let pooled: f64 = within().map(|s| s.ss_error).sum();
        let pooled_df: usize = within().map(|s| s.df_error).sum();
        let groups = self.group_sizes.len();
        let effect = |NamedEffect { mask, name }: &NamedEffect| {
            let between = self.has_groups && mask & 1 == 1;
            let within = mask >> usize::from(self.has_groups);
            let stratum = &strata[within];
            let (ss, df1) = if between {
                (stratum.ss_groups, stratum.df * (groups - 1))
            } else {
                (stratum.ss, stratum.df)
            };
            let (ss_error, df2) = if errors == ErrorModel::Pooled && within > 0 {
                (pooled, pooled_df)
            } else {
                (stratum.ss_error, stratum.df_error)
            };
            let kept = |ss: f64| if ss > floor { ss } else { 0.0 };
            let (ss, ss_error) = (kept(ss), kept(ss_error));
            let f = Ratio::of(ss / df1 as f64, ss_error / df2 as f64);
            let p =
                |epsilon: f64| f.tail(|f| f_tail(f, epsilon * df1 as f64, epsilon * df2 as f64));
            let share = |rest: f64| (ss + rest > 0.0).then(|| ss / (ss + rest));
            let spheric = stratum.sphericity;
            Effect {
                name: name.clone(),
                errors,
                ss,
                ss_error,
                df1,
                df2,
                f,
                p: p(1.0),
                partial_eta2: share(ss_error),
                generalized_eta2: share(kept(all_error)),
                gg: spheric.map(|s| s.greenhouse_geisser),
                hf: spheric.map(|s| s.huynh_feldt),
                p_gg: spheric.and_then(|s| p(s.greenhouse_geisser)),
                p_hf: spheric.and_then(|s| p(s.huynh_feldt)),
                mauchly: spheric.and_then(|s| s.mauchly),
                mask: *mask,
            }
        };
        self.effects.iter().map(effect).collect()
    }

    /// One stratum for every effect within subjects; the first is for the subjects' means.
    fn strata(&self, values: &[f64], with_sphericity: bool) -> Vec<Stratum> {
        let mut coefficients = values.to_vec();
        let mut scratch = vec![0.0; self.cells];
        for subject in coefficients.chunks_exact_mut(self.cells) {
            self.contrasts.apply(subject, &mut scratch);
        }
        let group_means = self.take_group_means(&mut coefficients);
        let strata = 0..self.contrasts.effects();
        strata
            .map(|mask| self.stratum(mask, &group_means, &coefficients, with_sphericity))
            .collect()
    }

    /// Returns each group's mean coefficients, and subtracts them from `coefficients`.
    fn take_group_means(&self, coefficients: &mut [f64]) -> Vec<Vec<f64>> {
        let mut means = vec![vec![0.0; self.cells]; self.group_sizes.len()];
        for (subject, &group) in coefficients.chunks_exact(self.cells).zip(&self.group_of) {
            for (mean, c) in means[group].iter_mut().zip(subject) {
                *mean += c;
            }
        }
        for (mean, &size) in means.iter_mut().zip(&self.group_sizes) {
            mean.iter_mut().for_each(|m| *m /= size as f64);
        }
        for (subject, &group) in coefficients
            .chunks_exact_mut(self.cells)
            .zip(&self.group_of)
        {
            for (c, mean) in subject.iter_mut().zip(&means[group]) {
                *c -= mean;
            }
        }
        means
    }

    fn stratum(
        &self,
        mask: usize,
        group_means: &[Vec<f64>],
        deviations: &[f64],
        with_sphericity: bool,
    ) -> Stratum {
        let members = self.contrasts.members(mask);
        let d = members.len();
        let groups = group_means.len() as f64;
        let total: usize = self.group_sizes.iter().sum();
        // Unequal groups have equal weights in effects within subjects (type III).
        let weight = groups * groups
            / self
                .group_sizes
                .iter()
                .map(|&n| 1.0 / n as f64)
                .sum::<f64>();
        let (mut ss, mut ss_groups) = (0.0, 0.0);
        for &c in members {
            let sizes = || self.group_sizes.iter().map(|&n| n as f64);
            let plain = group_means.iter().map(|m| m[c]).sum::<f64>() / groups;
            let sum: f64 = group_means.iter().zip(sizes()).map(|(m, n)| n * m[c]).sum();
            let weighted = sum / total as f64;
            ss += weight * plain * plain;
            let apart = group_means.iter().zip(sizes());
            ss_groups += apart
                .map(|(m, n)| n * (m[c] - weighted).powi(2))
                .sum::<f64>();
        }
        let rows = || deviations.chunks_exact(self.cells);
        let df_error = total - group_means.len();
        let sphericity = (with_sphericity && mask > 0).then(|| {
            let mut covariance = vec![0.0; d * d];
            let mut own = vec![0.0; d];
            for row in rows() {
                for (o, &c) in own.iter_mut().zip(members) {
                    *o = row[c];
                }
                for (i, a) in own.iter().enumerate() {
                    for (s, b) in covariance[i * d..].iter_mut().zip(&own) {
                        *s += a * b;
                    }
                }
            }
            covariance.iter_mut().for_each(|s| *s /= df_error as f64);
            let covariance = Covariance {
                entries: &covariance,
                dimension: d,
                df: df_error,
                cells: self.cells,
            };
            covariance.sphericity()
        });
        let squares = |row: &[f64]| members.iter().map(|&c| row[c] * row[c]).sum::<f64>();
        Stratum {
            ss,
            ss_groups,
            ss_error: rows().map(squares).sum(),
            df: d,
            df_error: d * df_error,
            sphericity,
        }
    }
}

/// Largest sum of squares that can come from rounding of the values.
fn rounding_floor(values: &[f64]) -> f64 {
    let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    values.len() as f64 * (8.0 * f64::EPSILON * largest).powi(2)
}
