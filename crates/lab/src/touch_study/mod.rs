//! A study of touch, from protocol to report, for the example `study`.

pub mod arm;
mod outputs;
pub mod people;
pub mod settings;
pub mod simulated;
