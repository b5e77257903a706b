//! Integration tests of the crate, one program.

mod invariances;
mod joint;
mod reference;
