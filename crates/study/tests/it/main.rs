//! Integration tests of the crate, one program.

mod arm;
mod common;
mod log;
mod ready;
mod simulation;
