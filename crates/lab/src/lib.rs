//! Studies, their baselines, validation, speed measurements, and the documents they write.
//!
//! Not published; the libraries under `crates/` do the work. The command lines of these
//! modules are in `examples/`.

/// Runs the code of the workspace's README and of its table of crates as tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
#[doc = include_str!("../../../docs/CRATES.md")]
struct Pages;

pub mod architecture;
pub mod dissertation;
pub mod documents;
pub mod report;

pub mod attack;
pub mod bip;
pub mod contact;
pub mod demonstrations;
pub mod end_to_end;
pub mod faults;
pub mod feel;
pub mod in_time;
pub mod passivity;
pub mod psychophysics;
pub mod reach;
pub mod rooms;
pub mod study;
pub mod texture;
pub mod thesis;
pub mod touch_study;

pub mod speed;
pub mod validation;
