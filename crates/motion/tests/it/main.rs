//! Integration tests of the crate, one program.

mod joint;
mod reference;
