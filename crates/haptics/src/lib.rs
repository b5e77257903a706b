#![doc = include_str!("../README.md")]

mod arm;
mod board;
pub mod body;
mod error;
mod low_pass;
pub mod motion;
mod nominal_step;
pub mod object;
pub mod passivity;
pub mod render;
pub mod safety;

pub use arm::{Arm, ArmCommand, ArmState};
pub use board::{Board, BoardTarget, PlaceTolerance, QUARTER_TURNS_RAD, board_pose, surface_axes};
pub use error::HapticsError;
pub use motion::{
    ApproachConfig, Barrier, BarrierTree, Follower, FollowerConfig, LinkInFront, PREPOSITION_SHARE,
    Planner, PlannerConfig, Slide,
};
pub use object::{Click, Detent, MovingObject, ObjectConfig, ObjectPath};
pub use passivity::{PassivePort, PassivityMethod, PortConfig, PortInput, PortOutput};
pub use render::{
    CartesianImpedance, ContactConfig, ContactDetector, ContactState, FaceMotion, ForceConfig,
    FrictionLeft, HoldReason, ImpedanceConfig, JointGuard, ObjectCommand, ObjectPortConfig,
    ObjectRendering, ObjectRenderingConfig, ObjectStep, Phase, PortLedger, PostureTarget,
    ProximityConfig, RenderInput, RenderStep, RenderedObject, Renderer, RendererConfig,
    WatchdogConfig,
};

pub use safety::{
    ContactLimits, SafeReason, SafeRequest, SafeState, Supervisor, SupervisorConfig,
    SupervisorInput, SupervisorStep,
};

pub use hwall_geometry::{ArgumentError, GeometryError, glam};
pub use hwall_kinematics as kinematics;
pub use hwall_motion::{MotionConfig, MotionLimits};
