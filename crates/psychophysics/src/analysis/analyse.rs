//! The whole analysis of a study in one call.

use super::anova::{Design, Effect, ErrorModel, anova};
use super::art::{ArtEffect, aligned_rank_transform};
use super::assumptions::{Assumptions, Warning, pooled_unequal};
use super::means::{CellMean, cell_means};
use super::posthoc::{Adjustment, Comparison, art_contrasts, pairwise};
use crate::error::Result;
use crate::study::{Factor, LeftOut, Normalisation, Study};
use serde::Serialize;

/// Settings of [`analyse`].
#[derive(Debug, Clone, PartialEq)]
pub struct AnalysisConfig {
    /// Scaling of the subjects' answers, applied first.
    pub normalisation: Normalisation,
    /// Error models, one table each.
    pub errors: Vec<ErrorModel>,
    /// Whether to compute the aligned rank transform, too.
    pub art: bool,
    /// Comparison of all pairs of levels of each factor; with `art` also by ART-C.
    pub posthoc: Option<Adjustment>,
    /// Confidence of all intervals.
    pub confidence: f64,
}

impl Default for AnalysisConfig {
    /// Plain values, strata, no ranks, no comparisons, intervals of 95 %.
    fn default() -> Self {
        Self {
            normalisation: Normalisation::None,
            errors: vec![ErrorModel::Strata],
            art: false,
            posthoc: None,
            confidence: 0.95,
        }
    }
}

/// Results of [`analyse`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Analysis {
    /// Size of the study.
    pub design: DesignSummary,
    /// Scaling of the subjects' answers.
    pub normalisation: Normalisation,
    /// Mean of all values, after normalisation.
    pub grand_mean: f64,
    /// Confidence of all intervals.
    pub confidence: f64,
    /// Mean of every cell.
    pub cells: Vec<CellMean>,
    /// Analysis of variance: all effects with the first error model, then with the next.
    pub effects: Vec<Effect>,
    /// Aligned rank transform, in the same order; empty unless asked for.
    pub art: Vec<ArtEffect>,
    /// Pairs of levels; empty unless asked for.
    pub posthoc: Vec<Comparison>,
    /// Pairs of levels on aligned ranks (ART-C), once for each error they are tested against; empty unless both
    /// `art` and `posthoc` were requested.
    pub art_posthoc: Vec<Comparison>,
    /// The adjustment of the p values that reports show.
    pub adjustment: Option<Adjustment>,
    /// Diagnostics.
    pub assumptions: Assumptions,
    /// Warnings about the results.
    pub warnings: Vec<Warning>,
}

/// Size of a study.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DesignSummary {
    /// Subjects.
    pub subjects: usize,
    /// Values analysed.
    pub values: usize,
    /// Trials averaged into each value.
    pub rounds: usize,
    /// Name of the column of values.
    pub value: String,
    /// Factors within subjects.
    pub within: Vec<Factor>,
    /// Factor between subjects.
    pub between: Option<Factor>,
    /// Subjects left out for missing answers.
    pub left_out: Vec<LeftOut>,
    /// Rows of the table marked invalid.
    pub invalid_rows: usize,
}

/// Analyses a study: means, variance, ranks, pairs, diagnostics.
///
/// # Errors
/// As [`Study::normalise`], [`anova()`], [`aligned_rank_transform`] and [`pairwise`].
pub fn analyse(study: &Study, config: &AnalysisConfig) -> Result<Analysis> {
    let (given, study) = (study, &study.normalise(config.normalisation)?);
    let names: Vec<&str> = study.within().iter().map(|f| f.name.as_str()).collect();
    let assumptions = Assumptions::of(study, given);
    let (mut effects, mut art) = (Vec::new(), Vec::new());
    let (mut posthoc, mut art_posthoc) = (Vec::new(), Vec::new());
    for &errors in &config.errors {
        effects.extend(anova(study, errors)?);
        if config.art {
            art.extend(aligned_rank_transform(study, errors)?);
        }
    }
    if config.posthoc.is_some() {
        for factor in study.factors().map(|f| f.name.as_str()) {
            posthoc.extend(pairwise(study, &[factor], config.confidence)?);
            if config.art {
                for &errors in &config.errors {
                    let pairs = art_contrasts(study, &[factor], errors, config.confidence)?;
                    // Groups are compared by Welch's test under every error model, so drop repeated pairs.
                    let is_new = |pair: &Comparison| !art_posthoc.contains(pair);
                    let new: Vec<Comparison> = pairs.into_iter().filter(is_new).collect();
                    art_posthoc.extend(new);
                }
            }
        }
    }
    let mut warnings = assumptions.against_anova(&effects);
    if config.errors.contains(&ErrorModel::Pooled) {
        let strata = Design::of(study)?.test(study.values(), ErrorModel::Strata);
        warnings.extend(pooled_unequal(&strata));
    }
    if config.art {
        warnings.extend(assumptions.against_aligned_ranks(study.values().len()));
    }
    let values = study.values();
    Ok(Analysis {
        design: DesignSummary::of(study),
        normalisation: config.normalisation,
        grand_mean: values.iter().sum::<f64>() / values.len() as f64,
        confidence: config.confidence,
        cells: cell_means(study, &names, config.confidence)?,
        effects,
        art,
        posthoc,
        art_posthoc,
        adjustment: config.posthoc,
        assumptions,
        warnings,
    })
}

impl DesignSummary {
    fn of(study: &Study) -> Self {
        Self {
            subjects: study.subjects().len(),
            values: study.values().len(),
            rounds: study.rounds(),
            value: study.value_name().to_owned(),
            within: study.within().to_vec(),
            between: study.between().map(|g| g.factor.clone()),
            left_out: study.left_out().to_vec(),
            invalid_rows: study.invalid_rows(),
        }
    }
}

impl Analysis {
    /// All numbers as JSON, to full precision.
    ///
    /// A number that does not exist is `null`; a ratio without error is `"infinite"` or `"undefined"`.
    ///
    /// # Panics
    /// Never: every part has names and numbers that JSON can hold.
    #[must_use]
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("names and numbers only")
    }
}
