//! Integration tests of the crate in one binary.

mod common;
mod exact;
mod exact_choices;
#[cfg(feature = "exr")]
mod exr;
mod forged_map;
mod invariances;
mod keep_out;
mod map;
mod margins;
mod optimization;
mod placement;
mod placement_requests;
mod plane;
mod polygon;
mod wall_maps;
