//! What a study does: factors, procedure, and the plan of every subject.

mod plan;
mod settings;

pub use plan::{Planned, PlannedTrial, TrialKind};
pub use settings::{Procedure, Protocol, StudyFactor, TrialOrder};
