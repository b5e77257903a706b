#![doc = include_str!("../README.md")]

mod arm;
mod board;
mod contact;
mod error;
mod follower;
mod profile;
mod renderer;
mod slide;

pub use arm::{Arm, ArmCommand, ArmState};
pub use board::{Board, BoardTarget, QUARTER_TURNS_RAD, board_pose, surface_axes};
pub use contact::{ContactConfig, ContactDetector, ContactState};
pub use error::HapticsError;
pub use follower::{Follower, FollowerConfig};
pub use profile::{JointBounds, JointMotion};
pub use renderer::{
    ApproachConfig, ForceConfig, HoldReason, Phase, RenderStep, Renderer, RendererConfig,
    WatchdogConfig,
};
pub use slide::Slide;
