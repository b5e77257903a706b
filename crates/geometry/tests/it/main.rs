//! Integration tests of the crate, one program.

mod faults;
#[cfg(feature = "serde")]
mod files;
mod identities;
