#![doc = include_str!("../README.md")]

mod arm_angles;
mod branch;
mod chain;
mod chain_motion;
mod chain_presets;
mod circle;
#[cfg(feature = "dynamics")]
mod dynamics;
mod error;
mod forward;
mod inertia;
mod inverse;
mod joints;
mod linalg;
mod margin;
mod nearest;
mod numeric;
mod pinched;

mod redundancy;
mod region;
mod srs;
mod statics;
mod trig;
#[cfg(feature = "urdf")]
mod urdf;
mod verdict;
mod window;

pub use arm_angles::{ArmAngleArc, FeasibleArmAngles};
pub use branch::{Branch, BranchSet};
pub use chain::{Chain, ChainJoint, JointKind};
pub use chain_motion::{ChainJacobian, ChainScratch};
#[cfg(feature = "dynamics")]
pub use dynamics::{ChainDynamics, DynamicsScratch, GRAVITY_M_PER_S2};
pub use error::KinematicsError;
pub use forward::Jacobian;
pub use hwall_geometry::{
    self as geometry, ArgumentError, GeometryError, Pose, ROTATION_TOLERANCE, Twist, Wrench, glam,
    rotation_vector,
};
pub use inertia::Inertial;
pub use joints::{JointLimit, JointPositions, JointTorques, JointVelocities};
pub use nearest::{BranchPolicy, NearestConfig, NearestSolution};
pub use numeric::{NumericConfig, NumericReport, NumericScratch, NumericSolution};
pub use redundancy::Dexterity;
pub use region::{PoseRegion, RegionVerdict};
pub use srs::{SrsArm, SrsGeometry, SrsParameters};
pub use statics::WrenchEstimate;
pub use verdict::{Unreachable, Verdict, Witness};
