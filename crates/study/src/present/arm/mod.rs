//! Trials on an arm that runs in its own time, with the tracked hand of whoever takes part.

mod desk;
mod ending;
mod observed;
mod room;
mod stage;

pub use observed::ArmTrialConfig;
pub use room::StudyRoom;
pub use stage::{ArmStage, ArmStop, check_surfaces};
