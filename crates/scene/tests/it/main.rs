//! Integration tests of the crate in one binary.

mod attacks;
mod common;
mod hard_cases;
mod invariances;
mod load;
mod oracle;
mod queries;
mod sidecar;
mod together;
mod watertight;
