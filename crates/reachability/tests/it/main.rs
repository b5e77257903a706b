//! Integration tests of the crate, one program.

mod common;
mod exact;
#[cfg(feature = "exr")]
mod exr;
mod forged_map;
mod keep_out;
mod map;
mod optimization;
mod placement;
mod placement_requests;
mod plane;
mod polygon;
mod wall_maps;
