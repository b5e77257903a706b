//! The log of a study: one line per event, written to disk before the study continues.

mod event;
mod event_log;
mod line;

pub use event::Event;
pub use event_log::{Durability, EventLog, Recovered};
