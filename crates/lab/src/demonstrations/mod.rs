//! Reaches of simulated people.

pub mod generate;
pub mod targets;
