//! Evaluation of a run: for each touch the result, the optimum, and the cause of a miss.

pub mod courses;
pub mod judge;
pub mod least_time;
pub mod regret;
