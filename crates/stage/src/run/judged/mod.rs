//! How a run went: touch by touch, what was possible, and why it was not done.

pub mod courses;
pub mod judge;
pub mod least_time;
pub mod regret;
