//! Tests of single samples: normality, and symmetry about zero.

mod ranks;
mod shapiro;
mod wilcoxon;

pub use shapiro::{ShapiroWilk, shapiro_wilk};
pub use wilcoxon::{Wilcoxon, wilcoxon_signed_rank};

pub(crate) use ranks::{average_ranks, tie_sizes};
pub(crate) use wilcoxon::signed_rank_of;
