//! When and where to send the board: the choice of least expected loss, from the belief about the next touch and travel times.

mod available_time;
mod config;
mod decision;
mod expected_loss;
mod explanation;
mod fixations;
mod hand_motion;
mod slack;
mod way;

pub use config::{PolicyConfig, SlackConfig};
pub(super) use decision::{Decision, Policy};
pub use explanation::{Explanation, Explanations, WeighedChoice, WeighedPlace};
pub(super) use way::{Presenting, Stand};
