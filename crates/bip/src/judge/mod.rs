//! Evaluation of filters, and selection of basis and parameters.
//!
//! # Which noise, and what is evaluated
//!
//! There are three noises. The residual of the fit is the published convention, and far too small for an unseen person. The second is the residual
//! of held-out demonstrations. The third is the second times the factor found by `tune`; filters use it if the model has it. A person deviates in
//! the same direction for many samples; a filter that counts each as new evidence needs this larger noise.
//!
//! `follow` and `leave_one_out` evaluate `predict_at`. Filters of a tuned model use its tuning by default; `leave_one_out` trains new models, so
//! pass `|m| Filter::new(&m.clone().with_tuning(t)?, &config)` to evaluate a tuning.

mod evaluation;
mod motion_filter;
mod selection;
mod tuning;

pub use evaluation::{
    EndPrediction, Evaluation, EvaluationConfig, TimePrediction, follow, leave_one_out,
};
pub use motion_filter::MotionFilter;
pub use selection::{Criterion, SelectionConfig, default_candidates, select_groups};
pub use tuning::{Trial, Tuned, TuningConfig, tune};

/// `each(0), each(1), ...` in order; with the feature `parallel` on all cores.
fn map_indexed<T: Send>(count: usize, each: impl Fn(usize) -> T + Sync) -> Vec<T> {
    if cfg!(feature = "parallel") {
        hwall_numeric::parallel::map(count, each)
    } else {
        (0..count).map(each).collect()
    }
}
