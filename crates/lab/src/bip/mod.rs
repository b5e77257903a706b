//! bip

pub mod figures;
pub mod reaches;
pub mod report;
pub mod run;
pub mod scores;
pub mod setup;
pub mod trajectories;
