//! When the board goes where, and what is known of hand and eyes to decide it.

mod config;
mod decision;
mod edge;
mod hand_course;
mod looks;
mod pace;
mod presenting;
mod sight;

pub use config::PolicyConfig;
pub(super) use decision::{Decision, Policy};
pub(super) use presenting::Presenting;
