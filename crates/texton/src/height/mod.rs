//! Heights over a regular grid of places, and their files.

mod exr_file;
mod field;

pub use exr_file::HeightSource;
pub use field::HeightField;
