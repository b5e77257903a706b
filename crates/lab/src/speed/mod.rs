//! The measurements of `speed_against_error`: a chapter a crate, a function a table.

pub mod bip;
pub mod contact;
pub mod document;
pub mod feel;
pub mod fusion;
pub mod kinematics;
pub mod knobs;
pub mod multiples;
pub mod reach;
pub mod roughness;
pub mod scene;
pub mod section;
pub mod texture;
