//! Every fault in every phase of a touch: the safe state reached, its delay, and the load on the hand.

mod bench;
pub mod document;
pub mod fault;
pub mod figure;
pub mod impact;
pub mod leaning;
mod number;
pub mod outcome;
mod predictor;
pub mod random;
mod run;
mod script;
pub mod study;
