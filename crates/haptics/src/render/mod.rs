//! What the arm does now: follow, wait, hold, or slide under the hand.

mod contact;
mod hold;
mod renderer;

pub use contact::{ContactConfig, ContactDetector, ContactState};
pub use hold::HoldReason;
pub use renderer::{
    ApproachConfig, ForceConfig, Phase, RenderStep, Renderer, RendererConfig, WatchdogConfig,
};
