//! Comparisons with published results: the sections of `docs/VALIDATION.md`.

pub mod bip;
pub mod document;
pub mod perception;
pub mod reachability;
pub mod texture;
