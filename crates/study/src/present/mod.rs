//! Presentation of a condition: wanted stimulus, rendered stimulus, and the arms that present it.

mod arm;
mod hand;
mod patch;
mod presenter;
mod simulated;
mod stimulus;

pub use arm::{ArmStage, ArmStop, ArmTrialConfig, StudyRoom, check_surfaces};
pub use patch::Patch;
pub use presenter::Presenter;
pub use simulated::{SimulatedStage, scene_of};
pub(crate) use stimulus::round;
pub use stimulus::{Fault, Presentation, Rendered, Stimulus, Surface};
