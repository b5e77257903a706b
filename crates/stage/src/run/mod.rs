//! One run of the closed loop: its log and its evaluation.

pub(crate) mod arm_error;
pub mod base_by_arrival;
pub mod behind_fri;
pub mod closed_loop;
pub mod evaluation;
pub mod logs;
pub mod people;
pub mod simulated_arm;
pub mod stage;
