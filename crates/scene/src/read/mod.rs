//! From files and triangles to checked surfaces.

mod frame;
mod materials;
mod mesh;
mod obj;
mod sidecar;

pub use frame::FileFrame;
pub(crate) use mesh::repaired;
pub use mesh::{LoadReport, SurfaceMesh};
pub(crate) use obj::parse;
pub use obj::{LoadLimits, UNNAMED, read_text};
pub(crate) use sidecar::apply;
