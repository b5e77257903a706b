//! Seeded mutational fuzzing: hostile inputs from good ones, and a reader's reactions.

mod mutation;
mod report;

pub use mutation::Mutator;
pub use report::{AttackReport, Finding, Verdict, attack};
