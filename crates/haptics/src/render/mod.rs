//! What the arm does now: follow, wait, hold, or slide under the hand.

mod contact;
mod force_lead;
mod hold;
mod impedance;
mod object_rendering;
mod path_follower;
mod proximity;
mod renderer;

pub use contact::{ContactConfig, ContactDetector, ContactState};
pub use hold::HoldReason;
pub use impedance::{CartesianImpedance, FaceMotion, FrictionLeft, ImpedanceConfig};
pub use object_rendering::{
    ObjectCommand, ObjectRendering, ObjectRenderingConfig, ObjectStep, RenderedObject,
};
pub use proximity::ProximityConfig;
pub(crate) use proximity::distance_and_closing;
pub use renderer::{
    ForceConfig, Phase, PostureTarget, RenderInput, RenderStep, Renderer, RendererConfig,
    WatchdogConfig,
};
