//! Regressions of the remaining displacement, and trees that correct them.

pub(super) mod correction;
pub(super) mod gates;
pub(super) mod local_ridge;
pub(super) mod training;
pub(super) mod trees;
