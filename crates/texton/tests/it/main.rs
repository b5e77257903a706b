//! Integration tests of the crate, one program.

mod calibration;
mod common;
mod design;
mod encoding;
mod geometry;
#[cfg(feature = "exr")]
mod height_field;
mod invariances;
mod material;
#[cfg(feature = "png")]
mod material_png;
mod mesh;
mod motion;
mod print_check;
mod reference;
mod roughness;
#[cfg(feature = "exr")]
mod roughness_map;
