//! texture

pub mod patch;
pub mod patch_figures;
pub mod touch;
