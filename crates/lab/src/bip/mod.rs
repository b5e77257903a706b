//! bip

pub mod baselines;
pub mod figures;
pub mod held_out;
pub mod published_filter;
pub mod reaches;
pub mod recording_figures;
pub mod recordings;
pub mod regression;
pub mod report;
pub mod run;
pub mod scores;
pub mod setup;
pub mod study;
pub mod trajectories;
