#![doc = include_str!("../README.md")]

mod encounter;
mod error;
mod layout;
mod presets;
mod scan;
mod texton;
mod texture;

pub use encounter::Encounter;
pub use error::TextonError;
pub use layout::Layout;
pub use scan::ScanAngle;
pub use texton::{Texton, TextonShape};
pub use texture::Texture;
