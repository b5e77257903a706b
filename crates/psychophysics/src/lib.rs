#![doc = include_str!("../README.md")]

pub mod analysis;
mod bisection;
pub mod design;
mod error;
pub mod models;
mod numbers;
pub mod procedures;
mod report;
pub mod samples;
pub mod study;
pub mod tails;

pub use error::PsychophysicsError;
pub use hwall_numeric::ArgumentError;

// A study, its table and its scale.
pub use study::{Columns, Factor, Groups, LeftOut, MOST_FACTORS, Missing, Normalisation, Study};
// Analysis: effects of factors, differences between levels, and checks of the tests' assumptions.
pub use analysis::{
    Adjustment, Analysis, AnalysisConfig, ArtEffect, Assumptions, CellMean, Comparison,
    DesignSummary, Effect, EffectSize, ErrorModel, Mauchly, PairTest, Ratio, Warning,
    aligned_rank_transform, analyse, anova, art_contrasts, cell_means, cohen_dz_interval, pairwise,
};
// Design: order of conditions for each subject, and number of subjects.
pub use design::{
    EffectPower, PowerStudy, PowerTest, RatingTest, Schedule, ScheduledTrial, TrialOrder,
    balanced_latin_square, for_each_outcome, power, shares_of_mean,
};
// Models: growth of sensation with the stimulus, and the just noticeable difference.
pub use models::{
    MagnitudeAnswer, PairAnswers, PowerLaw, Psychometric, Sigmoid, fit_psychometric, stevens_fit,
};
// Adaptive procedures, and thresholds with intervals.
pub use procedures::{
    QuestEstimate, QuestGrid, QuestPlus, Staircase, StaircaseConfig, StaircaseEstimate, Threshold,
    threshold,
};
// Tests of single samples, and tail probabilities.
pub use samples::{
    Median, ShapiroWilk, Share, SignTest, Wilcoxon, binomial_test, median, shapiro_wilk, sign_test,
    wilcoxon_signed_rank, wilcoxon_signed_rank_exact,
};
pub use tails::{
    chi2_tail, f_tail, noncentral_f_cdf, noncentral_t_cdf, normal_cdf, normal_quantile,
    normal_tail, t_quantile_two_sided, t_tail_two_sided,
};
