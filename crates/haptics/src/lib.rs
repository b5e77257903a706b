#![doc = include_str!("../README.md")]

mod arm;
mod board;
mod contact;
mod error;
mod follower;
mod motion;
mod renderer;

pub use arm::{Arm, ArmCommand, ArmState};
pub use board::{Board, BoardTarget, QUARTER_TURNS_RAD, board_pose, reachable_roll};
pub use contact::{ContactConfig, ContactDetector};
pub use error::HapticsError;
pub use follower::{Follower, FollowerConfig};
pub use motion::JointMotion;
pub use renderer::{HoldReason, Phase, RenderStep, Renderer, RendererConfig};
