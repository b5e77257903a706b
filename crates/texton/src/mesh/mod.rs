//! Triangle meshes: solids, their files, and the fineness of their tessellation.

mod files;
mod tessellation;
mod triangle_mesh;
mod triangulate;

pub use files::StlFormat;
pub use tessellation::{ChordSide, Tessellation};
pub use triangle_mesh::{MeshCheck, TriangleMesh};

pub(crate) use triangulate::{inside, outline};
