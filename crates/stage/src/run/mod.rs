//! One run of the closed loop: its log and its evaluation.

pub mod base_by_arrival;
pub mod closed_loop;
pub mod evaluation;
pub mod logs;
pub mod people;
pub mod simulated_arm;
pub mod stage;
