//! Tables and figures of a run, and the common style of figures.

pub mod figure;
pub mod figures;
pub mod json;
mod legend;
pub mod outputs;
pub mod plan_figure;
pub mod run_figures;
pub mod summary;
pub mod tables;
