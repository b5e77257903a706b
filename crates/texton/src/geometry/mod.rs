//! Bumps, their grids, and the bumps a finger meets when it crosses them.

mod closest;
mod encounter;
mod layout;
mod scan;
mod spectrum;
mod texton;
mod texture;

pub use encounter::Encounter;
pub use layout::Layout;
pub use scan::ScanAngle;
pub use spectrum::Harmonic;
pub use texton::{Radii, Texton, TextonShape};
pub use texture::Texture;

pub(crate) use closest::closest_on;
