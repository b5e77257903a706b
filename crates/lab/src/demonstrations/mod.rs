//! Reaches of simulated people, with the answer of the simulated arm, in memory and as files.

pub mod files;
pub mod generate;
pub mod targets;
