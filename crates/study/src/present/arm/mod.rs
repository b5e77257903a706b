//! Trials on an arm that runs in real time, with the participant's tracked hand.

mod desk;
mod ending;
mod observed;
mod room;
mod stage;

pub use observed::ArmTrialConfig;
pub use room::StudyRoom;
pub use stage::{ArmStage, ArmStop, check_surfaces};
