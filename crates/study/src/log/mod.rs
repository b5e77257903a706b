//! The log of a study: every event is one line, and on the disk before the study goes on.

mod event;
mod event_log;
mod line;

pub use event::Event;
pub use event_log::{Durability, EventLog, Recovered};
