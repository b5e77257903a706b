//! Every fault in every phase of a touch: the safe state reached, its delay, and the load on the hand.

pub mod bench;
pub mod document;
pub mod fault;
pub mod random;
pub mod run;
mod script;
pub mod spoiled;
pub mod study;
