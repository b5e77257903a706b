#![doc = include_str!("../README.md")]

mod bump_mesh;
mod cell;
mod chord_error;
mod encounter;
mod error;
mod height_exr;
mod height_field;
mod layout;
mod mesh;
mod mesh_files;
mod patch;
mod patch_mesh;
mod presets;
mod print_check;
mod scan;
mod surface;
mod tessellation;
mod texton;
mod texture;
mod triangulate;

pub use encounter::Encounter;
pub use error::TextonError;
pub use height_exr::HeightSource;
pub use height_field::HeightField;
pub use layout::Layout;
pub use mesh::{MeshCheck, TriangleMesh};
pub use mesh_files::StlFormat;
pub use patch::{BumpCounts, MountingHole, Patch, PatchSpec};
pub use print_check::{Finding, Printer};
pub use scan::ScanAngle;
pub use tessellation::{ChordSide, Tessellation};
pub use texton::{Texton, TextonShape};
pub use texture::Texture;
