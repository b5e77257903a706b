//! How good a filter is, and which basis and parameters are best.

mod evaluation;
mod motion_filter;
mod selection;
mod threads;
mod tuning;

pub use evaluation::{
    EndPrediction, Evaluation, EvaluationConfig, TimePrediction, follow, leave_one_out,
};
pub use motion_filter::MotionFilter;
pub use selection::{
    Criterion, Score, SelectionConfig, at_edge, default_candidates, score_bases, select_basis,
    select_groups,
};
pub use tuning::{Trial, Tuned, TuningConfig, tune};
