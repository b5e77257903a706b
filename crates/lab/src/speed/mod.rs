//! The measurements of `speed_against_error`: a chapter a crate, a function a table.

pub mod bip;
pub mod connect;
pub mod contact;
pub mod document;
pub mod feel;
pub mod fusion;
mod hand_to_fri;
pub mod kinematics;
pub mod knobs;
pub mod multiples;
pub mod reach;
mod recorded_minute;
pub mod roughness;
pub mod scene;
pub mod section;
pub mod texture;
