//! demonstrations

pub mod files;
pub mod generate;
pub mod targets;
