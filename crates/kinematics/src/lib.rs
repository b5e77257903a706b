#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod arm;
pub mod chain;
mod error;
mod jacobian;
mod joints;
mod linalg;
pub mod srs;
mod trig;
mod unreachable;
mod wrench;

// Any arm.
pub use arm::{
    ArmKinematics, ArmScratch, ArmSolution, BodyPoints, ChainArm, MOST_BODY_POINTS, foot_on_second,
};

// The closed form of S-R-S arms.
pub use srs::{
    ArmAngleArc, Branch, BranchPolicy, BranchSet, Dexterity, FeasibleArmAngles, NearestConfig,
    NearestLimit, NearestSolution, PoseRegion, RegionVerdict, ShoulderWristRange, SrsArm,
    SrsGeometry, SrsParameters, Verdict, Witness,
};

// Serial chains.
pub use chain::{
    Chain, ChainJacobian, ChainJoint, ChainScratch, Inertial, JointKind, NumericConfig,
    NumericReport, NumericScratch, NumericSolution,
};
#[cfg(feature = "dynamics")]
pub use chain::{ChainDynamics, DynamicsScratch, EstimatedAccelerations, GRAVITY_M_PER_S2};

// Joints, forces, errors.
pub use error::KinematicsError;
pub use jacobian::Jacobian;
pub use joints::{JointLimit, JointPositions, JointTorques, JointVelocities, MOST_JOINTS};
pub use unreachable::Unreachable;
pub use wrench::{WrenchConfig, WrenchEstimate};

// Poses.
pub use hwall_geometry::{
    self as geometry, ArgumentError, GeometryError, Pose, PoseDistance, ROTATION_TOLERANCE, Twist,
    Wrench, glam, rotation_vector,
};
