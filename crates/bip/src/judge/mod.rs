//! How good a filter is, and which basis and parameters are best.
//!
//! # Which noise, and what is judged
//!
//! There are three noises: the residual of the fit (the published convention, far too small for a new person), the residual of
//! held-out demonstrations, and the latter times the factor found by `tune`, which filters use where the model has it. A person
//! deviates in the same direction for many samples; a filter that counts each as new evidence needs the larger noise.
//!
//! `follow` and `leave_one_out` judge `predict_at`. Filters of a tuned model use its tuning by default; `leave_one_out` trains models
//! anew, so give it `|m| Filter::new(&m.clone().with_tuning(t)?, &config)` to judge a tuning.

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
