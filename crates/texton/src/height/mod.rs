//! Heights over a regular grid of points, and their files.

#[cfg(feature = "exr")]
mod exr_file;
mod field;

#[cfg(feature = "exr")]
pub use exr_file::HeightSource;
pub use field::HeightField;
#[cfg(feature = "exr")]
pub(crate) use field::MOST_PIXELS;
