//! Any serial chain: forward kinematics, numeric inverse, URDF, dynamics.

mod axis_frame;
#[cfg(feature = "dynamics")]
mod body;
#[cfg(feature = "dynamics")]
mod dynamics;
#[cfg(feature = "dynamics")]
mod full_speed;
mod inertia;
mod joint;
mod model;
#[cfg(feature = "dynamics")]
mod momentum;
mod motion;
mod numeric;
mod presets;
#[cfg(feature = "urdf")]
mod urdf;

#[cfg(feature = "dynamics")]
pub use dynamics::{ChainDynamics, DynamicsScratch, GRAVITY_M_PER_S2};
#[cfg(feature = "dynamics")]
pub use full_speed::EstimatedAccelerations;
pub use inertia::Inertial;
pub use joint::{ChainJoint, JointKind};
pub use model::Chain;
pub use motion::{ChainJacobian, ChainScratch};
pub use numeric::{NumericConfig, NumericReport, NumericScratch, NumericSolution};
