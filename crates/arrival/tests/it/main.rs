//! Integration tests of the crate, one program.

mod atlas;
mod base;
mod common;
mod files;
mod placement;
mod searched;
mod waiting;
