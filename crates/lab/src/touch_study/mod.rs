//! A study of touch from its protocol to its report, for the example `study`.

mod figures;
mod outputs;
pub mod people;
pub mod settings;
pub mod simulated;
