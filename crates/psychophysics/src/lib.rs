#![doc = include_str!("../README.md")]

mod analysis;
mod anova;
mod art;
mod assumptions;
mod describe;
mod error;
mod latin;
mod lines;
mod normalise;
mod posthoc;
mod power;
mod psychometric;
mod random;
mod ranks;
mod ratio;
mod report;
mod schedule;
mod shapiro;
mod sphericity;
mod stevens;
mod study;
mod table;
mod tails;
mod transform;
mod wilcoxon;

pub use analysis::{Analysis, AnalysisConfig, DesignSummary, FactorSummary, analyse};
pub use anova::{Effect, ErrorModel, anova};
pub use art::{ArtEffect, aligned_rank_transform};
pub use assumptions::{Assumptions, Warning};
pub use describe::{CellMean, cell_means};
pub use error::PsychophysicsError;
pub use latin::balanced_latin_square;
pub use normalise::Normalisation;
pub use posthoc::{Adjustment, Comparison, PairTest, art_contrasts, pairwise};
pub use power::{EffectPower, PowerStudy, PowerTest, power};
pub use psychometric::{PairAnswers, Psychometric, Sigmoid, fit_psychometric};
pub use ratio::Ratio;
pub use schedule::{Schedule, ScheduledTrial, TrialOrder};
pub use shapiro::{ShapiroWilk, shapiro_wilk};
pub use sphericity::Mauchly;
pub use stevens::{PowerLaw, stevens_fit};
pub use study::{Factor, Groups, MOST_FACTORS, Study};
pub use table::Columns;
pub use tails::{
    chi2_tail, f_tail, normal_cdf, normal_quantile, normal_tail, t_quantile_two_sided,
    t_tail_two_sided,
};
pub use wilcoxon::{Wilcoxon, wilcoxon_signed_rank};
