//! The extremes of a line by constrained optimization, for any arm.

mod ascent;
mod solver;
mod tangent;
mod vector;

pub use solver::{Extreme, LineExtremes, OptimizationConfig, OptimizationSolver};
