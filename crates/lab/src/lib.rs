//! The laboratory: studies, baselines for studies, validation, speed and what they report.
//!
//! Nothing here is published.

/// Runs the code of the workspace's README as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

pub mod bip;
pub mod contact;
pub mod demonstrations;
pub mod psychophysics;
pub mod reach;
pub mod rooms;
pub mod speed;
pub mod texture;
pub mod validation;
