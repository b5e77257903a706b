//! Log of a run, for tables and figures.

pub mod log;
pub mod push_log;
pub mod snapshots;
pub mod texture_log;
pub mod tick;
pub mod trace;
pub mod view_log;
