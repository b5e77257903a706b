//! The protocol of a study: factors, procedure, and the plan of every subject.

mod arm_kind;
mod participants;
mod plan;
mod ready;
mod settings;

pub use arm_kind::ArmKind;
pub use hwall::psychophysics::Factor as StudyFactor;
pub use participants::Participants;
pub use plan::{Planned, PlannedTrial, TrialKind};
pub use ready::ReadyProtocol;
pub use settings::{Procedure, Protocol, TrialOrder};
