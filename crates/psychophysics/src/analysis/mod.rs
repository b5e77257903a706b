//! Analysis of a study: means, variance, ranks, pairs of levels, and checks of assumptions.

mod analyse;
mod anova;
mod art;
mod assumptions;
mod contrasts;
mod effect_size;
mod means;
mod posthoc;
mod ratio;
mod sphericity;

pub use analyse::{Analysis, AnalysisConfig, DesignSummary, analyse};
pub use anova::{Effect, ErrorModel, anova};
pub use art::{ArtEffect, aligned_rank_transform};
pub use assumptions::{Assumptions, Warning};
pub use effect_size::{EffectSize, cohen_dz_interval};
pub use means::{CellMean, cell_means};
pub use posthoc::{Adjustment, Comparison, PairTest, art_contrasts, pairwise};
pub use ratio::Ratio;
pub use sphericity::Mauchly;

pub(crate) use anova::Design;
pub(crate) use art::Aligner;
