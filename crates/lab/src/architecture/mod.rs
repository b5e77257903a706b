//! The picture of the crates and who uses whom, drawn from their manifests.

mod drawing;
mod graph;
mod layout;
mod manifests;

pub use drawing::svg;
pub use graph::{CrateGraph, CrateKind, CrateNode, Use};
pub use layout::{Layout, Place};
pub use manifests::read;
