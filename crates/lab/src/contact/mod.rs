//! contact

pub mod arguments;
pub mod candidates;
pub mod dissertation;
pub mod document;
pub mod figures;
pub mod moments;
pub mod recordings;
pub mod report;
pub mod rows;
pub mod scores;
pub mod tables;
