//! Arms with spherical shoulder, revolute elbow and spherical wrist, in closed form.

mod arm_angles;
mod branch;
mod circle;
mod forward;
mod from_chain;
mod inverse;
mod model;
mod nearest;
mod parameters;
mod redundancy;
mod verdict;

pub use arm_angles::{ArmAngleArc, FeasibleArmAngles};
pub use branch::{Branch, BranchSet};
pub use model::SrsArm;
pub(crate) use nearest::BESIDE_RAD;
pub use nearest::{BranchPolicy, NearestConfig, NearestSolution};
pub use parameters::{SrsGeometry, SrsParameters};
pub use redundancy::{Dexterity, NearestLimit};
pub use verdict::{PoseRegion, RegionVerdict, ShoulderWristRange, Verdict, Witness};
