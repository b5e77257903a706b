//! Presenting a condition: what is wanted, what was rendered, and an arm that does it.

mod hand;
mod simulated;
mod stimulus;

pub use simulated::SimulatedStage;
pub(crate) use stimulus::round;
pub use stimulus::{Fault, Presentation, Rendered, Stimulus, Surface};
