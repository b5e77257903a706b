//! Integration tests of the crate, one program.

mod allocation;
mod bank;
mod common;
mod ensemble;
mod evaluation;
#[cfg(feature = "serde")]
mod file;
mod hard_cases;
mod identities;
mod invariances;
mod lasting;
mod onset;
mod reference;
mod robustness;
mod selection;
mod trainer;
