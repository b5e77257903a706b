//! Textured boards: the patch to print, and a finger on a sliding board.

mod encounters;
pub mod patch;
pub mod patch_figures;
pub mod trial;
pub mod wanted;
