//! Every fault in every phase of a touch: which safe state it leads to, how soon, and what a hand meets meanwhile.

mod bench;
pub mod document;
pub mod fault;
pub mod figure;
pub mod impact;
mod number;
pub mod outcome;
mod predictor;
pub mod random;
mod run;
mod script;
pub mod study;
