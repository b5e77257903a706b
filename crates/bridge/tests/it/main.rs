//! Integration tests of the crate, one program.

mod common;
mod control_path;
mod protocol;
mod questions;
mod unity;
