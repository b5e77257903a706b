//! Any arm behind one interface.

mod body_points;
mod chain_arm;
mod kinematics;
mod srs_arm;

pub use body_points::{BodyPoints, MOST_BODY_POINTS, foot_on_second};
pub use chain_arm::ChainArm;
pub use kinematics::{ArmKinematics, ArmScratch, ArmSolution};
