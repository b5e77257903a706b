//! Is the board in place before the hand? All kinds of people, many touches.

pub mod document;
pub mod recorded;
pub mod study;
pub mod targets;
pub mod trade_off;
