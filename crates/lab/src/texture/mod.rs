//! Textured boards: roughness from pictures, the patch to print, and a finger on a sliding board.

pub mod assign;
pub mod fineness;
pub mod patch;
pub mod patch_figures;
pub mod stroke;
pub mod strokes;
pub mod trial;
pub mod wanted;
