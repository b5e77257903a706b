//! Seeded mutational fuzzing: hostile inputs from good ones, and what a reader did with them.

mod mutation;
mod report;

pub use mutation::Mutator;
pub use report::{AttackReport, Finding, Verdict, attack};
