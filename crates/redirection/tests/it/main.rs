//! Integration tests of the crate, one program.

mod reaching;
mod turning;
