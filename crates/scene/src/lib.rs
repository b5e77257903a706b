#![doc = include_str!("../README.md")]

mod error;
mod facet;
mod mechanics;
mod part;
mod queries;
mod read;
mod scene;
mod surface;

// The scene and its parts.
pub use mechanics::{Mechanics, SurfaceClick, SurfaceDetent};
pub use scene::{Bounds, Scene};
pub use surface::{OpeningRange, SlidingPart, Surface, SurfaceId, SurfaceKind};

// Queries and results.
pub use facet::{Facet, VERTICAL_TOLERANCE_RAD};
pub use part::BuildQuality;
pub use queries::{Hit, Ray};

// Reading.
pub use error::SceneError;
pub use part::triangle::COORDINATE_LIMIT_M;
pub use read::{FileFrame, LoadLimits, LoadReport, SurfaceMesh, UNNAMED, read_text};

pub use hwall_geometry::{self as geometry, ArgumentError, Pose, glam};
