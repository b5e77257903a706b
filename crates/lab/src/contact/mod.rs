//! Estimators of the end of a reach, evaluated on held-out reaches.

pub mod candidates;
pub mod dissertation;
pub mod figures;
pub mod panel_study;
pub mod panels;
pub mod recordings;
pub mod report;
pub mod rows;
pub mod run;
pub mod scores;
pub mod tables;
