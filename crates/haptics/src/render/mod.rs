//! What the arm does now: follow, wait, hold, or slide under the hand.

mod contact;
mod hold;
mod proximity;
mod renderer;

pub use contact::{ContactConfig, ContactDetector, ContactState};
pub use hold::HoldReason;
pub use proximity::ProximityConfig;
pub(crate) use proximity::distance_and_closing;
pub use renderer::{
    ForceConfig, Phase, PostureTarget, RenderInput, RenderStep, Renderer, RendererConfig,
    WatchdogConfig,
};
