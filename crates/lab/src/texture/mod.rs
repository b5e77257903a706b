//! Textured boards: roughness from pictures, the patch to print, and a finger on a sliding board.

pub mod assign;
pub mod encounters;
pub mod fineness;
pub mod patch;
pub mod patch_figures;
mod sidecar;
pub mod stroke;
pub mod stroke_tables;
pub mod strokes;
pub mod trial;
pub mod wanted;
