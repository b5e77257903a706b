//! Is the board there before the hand? Every kind of person, over many touches.

pub mod document;
pub mod study;
pub mod targets;
