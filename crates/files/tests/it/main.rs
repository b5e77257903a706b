//! Integration tests of the crate, one program.

mod files;
mod table;
