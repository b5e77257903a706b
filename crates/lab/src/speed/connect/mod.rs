//! What connecting and looking costs.

mod hand_to_fri;
pub mod measured;
mod recorded_minute;
mod session;
