//! The diagram of the crates and their dependencies, drawn from their manifests.

mod drawing;
mod graph;

pub use drawing::svg;
pub use graph::{Crate, CrateGraph, Use, read};
