//! Plates with bumps: placement of bumps, check for a printer, and the solid to print.

mod bump_mesh;
mod cell;
mod chord_error;
mod patch;
mod printer;
mod solid;

pub use patch::{BumpCounts, MountingHole, Patch, PatchSpec, Tile};
pub use printer::{Finding, Printer};
