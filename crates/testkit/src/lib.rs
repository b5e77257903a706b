#![doc = include_str!("../README.md")]

mod attack;
mod columns;
mod difference;
mod machine;
mod motion;
mod refused;
mod sampler;
mod shared;
mod stats;
mod table;
mod timing;
mod tolerance;
mod yardstick;

pub use attack::{AttackReport, Finding, Mutator, Verdict, attack};
pub use columns::{
    Claim, Column, cells, claims, grid, or_none, percent_of, quantiles, table_of, titled, yes_or_no,
};
pub use difference::central_difference;
pub use machine::Machine;
pub use motion::minimum_jerk;
pub use refused::refusal;
pub use sampler::{Sampler, seeds};
pub use shared::shared;
pub use stats::{ErrorStats, quantile};
pub use table::{MarkdownTable, SpeedErrorTable, format_error, format_ns};
pub use timing::{Timing, time_batches, time_each};
pub use tolerance::{Components, Tol, mismatch};
pub use yardstick::Yardstick;
