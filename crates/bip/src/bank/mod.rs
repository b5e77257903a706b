//! A bank of hypotheses for motions that do not continue as expected.
//!
//! A single filter that sees the hand at rest concludes that the phase is constant, becomes certain of this, and never recovers. A single filter
//! that sees a change of target explains it by the phase. Here each such event is a hypothesis with its own exact filter, weighted by its
//! predictive density.
//!
//! # How it works
//!
//! A bank is a jump Markov system. A moving hypothesis may pause, suddenly or by slowing down, or redraw its shape from the prior; a resting one
//! may continue with a new velocity or gather speed. Branching happens at every step: with less frequent branching, a stop one sample before the
//! next branching was mistaken for another shape, and the prediction was wrong by 20 to 30 mm for the rest of the motion. Nearly equal hypotheses
//! are merged, the lightest are dropped. An interacting multiple model would mix all histories of a mode into one Gaussian at each step, which
//! fails at a change of mind.

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
