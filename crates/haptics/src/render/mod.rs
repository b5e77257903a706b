//! What the arm does now: follow, wait, hold, or slide under the hand.

mod aim;
mod config;
mod contact;
mod face_slide;
mod force_lead;
mod hold;
mod impedance;
mod joint_guard;
mod making_way;
mod object_port;
mod object_rendering;
mod objects;
mod path_follower;
mod proximity;
mod renderer;
mod step;
mod supervised;

pub use config::{ForceConfig, RendererConfig, WatchdogConfig};
pub use contact::{ContactConfig, ContactDetector, ContactState};
pub use hold::HoldReason;
pub use impedance::{CartesianImpedance, FaceMotion, FrictionLeft, ImpedanceConfig};
pub use joint_guard::JointGuard;
pub use object_port::{ObjectPortConfig, PortLedger};
pub use object_rendering::{
    ObjectCommand, ObjectRendering, ObjectRenderingConfig, ObjectStep, RenderedObject,
};
pub use proximity::ProximityConfig;
pub(crate) use proximity::distance_and_closing;
pub use renderer::Renderer;
pub use step::{Phase, PostureTarget, RenderInput, RenderStep};
