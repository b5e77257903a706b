//! Integration tests of the crate, one program.

mod attacks;
mod between_and_missing;
mod common;
mod designs;
mod exact;
mod hard_cases;
mod identities;
mod models;
mod procedures;
mod reference;
mod table;
mod tails;
mod tests_of_samples;
