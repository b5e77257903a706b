//! Reaches of simulated people.

pub mod generate;
