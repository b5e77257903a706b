//! The measurements of `speed_against_error`: one module per crate, one function per table.

pub mod bip;
pub mod contact;
pub mod control_step;
pub mod document;
pub mod feel;
pub mod kinematics;
pub mod reach;
pub mod scene;
pub mod section;
pub mod texture;
