#![doc = include_str!("../README.md")]

mod error;
mod mesh;
mod obj;
mod part;
mod patch;
mod rigid;
mod scene;
mod sidecar;
mod surface;
mod tree;
mod triangle;

pub use error::SceneError;
pub use mesh::{COORDINATE_LIMIT_M, LoadReport, SurfaceMesh};
pub use obj::{LoadLimits, UNNAMED};
pub use patch::{Patch, VERTICAL_TOLERANCE_RAD};
pub use rigid::RIGID_TOLERANCE;
pub use scene::{Closest, Hit, Scene};
pub use surface::{Surface, SurfaceId, SurfaceKind};
pub use tree::BuildQuality;
