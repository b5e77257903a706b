//! A study of touch, from protocol to report, for the example `study`.

pub mod arm;
pub mod outputs;
pub mod people;
pub mod settings;
pub mod simulated;
pub mod thesis;
