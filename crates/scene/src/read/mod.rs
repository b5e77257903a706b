//! From files and triangles to checked surfaces.

mod materials;
mod mesh;
mod obj;
mod sidecar;

pub(crate) use mesh::repaired;
pub use mesh::{LoadReport, SurfaceMesh};
pub(crate) use obj::parse;
pub use obj::{LoadLimits, UNNAMED, read_text};
pub(crate) use sidecar::apply;
