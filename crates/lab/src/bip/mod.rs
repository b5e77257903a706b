//! Interaction primitives on folders of motions, for `bip_filter`.

pub mod figures;
pub mod published_filter;
pub mod reaches;
pub mod report;
pub mod run;
pub mod scores;
pub mod setup;
pub mod trajectories;
