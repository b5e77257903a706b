//! A bank of hypotheses: what a person may be doing instead of going on as expected.
//!
//! A single filter that sees the hand at rest concludes that the phase stands still, becomes certain
//! of it, and never recovers; one that sees a change of target explains it by the phase. Here
//! each such event is a hypothesis with its own exact filter, weighted by how
//! well it predicted what was observed.

mod branching;
mod component;
mod config;
mod filter_bank;
mod hypothesis;
mod mixture;
mod moments;

pub use component::Component;
pub use config::BankConfig;
pub use filter_bank::Bank;
pub use hypothesis::{HypothesisView, Mode};
pub use mixture::{Covariance, Grouping, Mixture};
