//! Any arm behind one interface.

mod chain_arm;
mod kinematics;
mod srs_arm;

pub use chain_arm::ChainArm;
pub use kinematics::{ArmKinematics, ArmScratch, ArmSolution};
