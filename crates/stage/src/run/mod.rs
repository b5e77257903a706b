//! One run of the closed loop: what it leaves behind, and how it is judged.

pub mod base_by_arrival;
pub mod closed_loop;
pub mod courses;
pub mod judge;
pub mod least_time;
pub mod people;
pub mod push_log;
pub mod regret;
pub mod simulated_arm;
pub mod snapshots;
pub mod texture_log;
pub mod tick;
pub mod trace;
pub mod view_log;
