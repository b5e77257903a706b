//! The picture of the crates and who uses whom, drawn from their manifests.

mod drawing;
mod graph;

pub use drawing::svg;
pub use graph::{Crate, CrateGraph, Use, read};
