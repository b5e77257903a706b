//! The extremes of a line by constrained optimization, for any arm.

mod ascent;
mod linalg;
mod solver;

pub use solver::{Extreme, LineExtremes, OptimizationConfig, OptimizationSolver};
