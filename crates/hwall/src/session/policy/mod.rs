//! When the board goes where, and what is known of hand and eyes to decide it.

mod available_time;
mod config;
mod decision;
mod edge;
mod fixations;
mod hand_motion;
mod presenting;
mod sight;

pub use config::PolicyConfig;
pub(super) use decision::{Decision, Policy};
pub(super) use presenting::Presenting;
