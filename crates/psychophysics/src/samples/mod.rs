//! Tests of single samples: normality, symmetry about zero, signs, shares; medians.

mod exact;
mod ranks;
mod shapiro;
mod wilcoxon;

pub use exact::{Median, Share, SignTest, binomial_test, median, sign_test};
pub use shapiro::{ShapiroWilk, shapiro_wilk};
pub use wilcoxon::{Wilcoxon, wilcoxon_signed_rank, wilcoxon_signed_rank_exact};

pub(crate) use ranks::{average_ranks, tie_sizes};
pub(crate) use wilcoxon::{signed_rank_of, signings};
