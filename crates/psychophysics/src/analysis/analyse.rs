//! The whole analysis of a study in one go.

use crate::anova::Layout;
use crate::assumptions::pooled_unequal;
use crate::{
    Adjustment, ArtEffect, Assumptions, CellMean, Comparison, Effect, ErrorModel, Normalisation,
    PsychophysicsError, Study, Warning, aligned_rank_transform, anova, art_contrasts, cell_means,
    pairwise,
};
use serde::Serialize;

/// What to compute.
#[derive(Debug, Clone, PartialEq)]
pub struct AnalysisConfig {
    /// Scaling of the subjects' estimates before all else.
    pub normalisation: Normalisation,
    /// Error models, each of which gives a table.
    pub errors: Vec<ErrorModel>,
    /// Aligned rank transform beside the plain analysis.
    pub art: bool,
    /// Comparison of all pairs of levels of each factor; with `art` by ART-C too.
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

/// Everything that [`analyse`] found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Analysis {
    /// The study in numbers.
    pub design: DesignSummary,
    /// Scaling of the subjects' estimates.
    pub normalisation: Normalisation,
    /// Mean of all values, after normalisation.
    pub grand_mean: f64,
    /// Confidence of all intervals.
    pub confidence: f64,
    /// Mean of every cell.
    pub cells: Vec<CellMean>,
    /// Analysis of variance: all effects by the first error model, then by the next.
    pub effects: Vec<Effect>,
    /// Aligned rank transform, in the same order; empty unless asked for.
    pub art: Vec<ArtEffect>,
    /// Pairs of levels; empty unless asked for.
    pub posthoc: Vec<Comparison>,
    /// Pairs of levels on aligned ranks (ART-C); empty unless both were asked for.
    pub art_posthoc: Vec<Comparison>,
    /// Which p value of the pairs the reports show.
    pub adjustment: Option<Adjustment>,
    /// Diagnostics.
    pub assumptions: Assumptions,
    /// What speaks against the results.
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
    pub within: Vec<FactorSummary>,
    /// Factor between subjects.
    pub between: Option<FactorSummary>,
}

/// Name and levels of a factor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FactorSummary {
    /// Name.
    pub name: String,
    /// Levels in order.
    pub levels: Vec<String>,
}

/// Analyses a study: means, variance, ranks, pairs, diagnostics.
///
/// # Errors
/// Whatever [`Study::normalise`], [`anova`], [`aligned_rank_transform`] and [`pairwise`] refuse.
pub fn analyse(study: &Study, config: &AnalysisConfig) -> Result<Analysis, PsychophysicsError> {
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
                    art_posthoc.extend(pairs);
                }
            }
        }
    }
    let mut warnings = assumptions.against_anova(&effects);
    if config.errors.contains(&ErrorModel::Pooled) {
        let strata = Layout::of(study)?.effects(study.values(), ErrorModel::Strata);
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
        let summary = |f: &crate::Factor| FactorSummary {
            name: f.name.clone(),
            levels: f.levels.clone(),
        };
        Self {
            subjects: study.subjects().len(),
            values: study.values().len(),
            rounds: study.rounds(),
            value: study.value_name().to_owned(),
            within: study.within().iter().map(summary).collect(),
            between: study.between().map(|g| summary(&g.factor)),
        }
    }
}

impl Analysis {
    /// All numbers as JSON, to full precision.
    ///
    /// A number that does not exist is `null`; a ratio without error is `"infinite"` or `"undefined"`.
    ///
    /// # Errors
    /// What the writer of JSON refuses; no analysis is known that it does.
    pub fn to_json(&self) -> Result<String, PsychophysicsError> {
        serde_json::to_string_pretty(self).map_err(|error| PsychophysicsError::Io {
            path: "analysis as JSON".to_owned(),
            message: error.to_string(),
        })
    }
}
