//! From files and triangles to checked surfaces.

mod frame;
mod materials;
mod mesh;
mod obj;
mod sidecar;
mod text;

pub use frame::FileFrame;
pub(crate) use mesh::repaired;
pub use mesh::{LoadReport, SurfaceMesh};
pub use obj::UNNAMED;
pub(crate) use obj::parse;
pub(crate) use sidecar::apply;
pub use text::{LoadLimits, read_text};
