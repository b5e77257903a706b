//! Integration tests of the crate in one binary.

mod faults;
#[cfg(feature = "serde")]
mod files;
mod identities;
