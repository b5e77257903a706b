//! A running study: its next step, its answers, and its log.

mod adaptive;
mod conduct;
mod progress;
mod record;
mod simulate;
mod study;

pub use adaptive::{Adaptive, AdaptiveThreshold};
pub use conduct::{Ask, Respondent, conduct};
pub use progress::NextStep;
pub use record::{StudyRecord, TrialRecord};
pub use simulate::{Simulation, simulate, simulate_and_tell};
pub use study::{Answer, Study};
