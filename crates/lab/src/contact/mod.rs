//! Estimators of the end of a reach, evaluated on held-out reaches.

pub mod candidates;
pub mod dissertation;
pub mod figures;
pub mod panels;
pub mod recordings;
pub mod report;
pub mod run;
pub mod tables;
