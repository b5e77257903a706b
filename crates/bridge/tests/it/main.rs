//! Integration tests of the crate, one program.

mod calibration;
mod common;
mod control_path;
mod protocol;
mod questions;
#[cfg(feature = "tls")]
mod tls;
mod unity;
