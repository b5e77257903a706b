//! What the arm does now: follow, wait, hold, or slide under the hand.

mod aim;
mod config;
mod contact;
mod hold;
mod making_way;
mod object;
mod proximity;
mod renderer;
mod step;
mod supervised;
mod yielding;

pub use config::{ForceConfig, RendererConfig, WatchdogConfig};
pub use contact::{ContactConfig, ContactDetector, ContactState};
pub use hold::HoldReason;
pub use object::impedance::{CartesianImpedance, FaceMotion, FrictionLeft, ImpedanceConfig};
pub use object::joint_guard::JointGuard;
pub use object::object_port::{ObjectPortConfig, PortLedger};
pub use object::object_rendering::{
    ObjectCommand, ObjectRendering, ObjectRenderingConfig, ObjectStep, RenderedObject,
};
pub use proximity::ProximityConfig;
pub(crate) use proximity::distance_and_closing;
pub use renderer::Renderer;
pub use step::{Phase, PostureTarget, RenderInput, RenderStep};
pub(crate) use yielding::{beyond, is_push};
