//! A study of touch from its protocol to its report, for the example `study`.

pub mod arm;
mod outputs;
pub mod people;
pub mod settings;
pub mod simulated;
