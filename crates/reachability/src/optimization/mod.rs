//! The extremes of lines and walls by constrained optimization, for any arm.

mod ascent;
mod chain_map;
mod solver;
mod tangent;
mod vector;

pub use chain_map::ChainMap;
pub use solver::{Extreme, LineExtremes, OptimizationConfig, OptimizationSolver};
