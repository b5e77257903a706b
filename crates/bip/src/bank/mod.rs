//! A bank of hypotheses: what a person may be doing instead of going on as expected.
//!
//! A single filter that sees the hand at rest concludes that the phase stands still, becomes certain
//! of it, and never recovers; one that sees a change of target explains it by the phase. Here
//! each such event is a hypothesis with its own exact filter, weighted by how
//! well it predicted what was observed.
//!
//! # How it works
//!
//! A bank is a jump Markov system. A moving hypothesis may pause, at once or by slowing down, or redraw its shape from the prior; a
//! resting one may go on with a new velocity or gather speed. This is asked at every step: when it was asked less often, a stop one
//! sample before the next question was taken for another shape, 20 to 30 mm off for the rest of the motion. Hypotheses that say
//! nearly the same are merged, the lightest are dropped. An interacting multiple model would mix all histories of a mode into one
//! Gaussian at each step, which fails at a change of mind.

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
pub use mixture::{Covariance, Mixture};
