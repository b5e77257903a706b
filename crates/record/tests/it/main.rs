//! Integration tests of the crate, one program.

mod common;
mod damage;
mod others_tools;
mod recording;
