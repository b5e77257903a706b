//! Errors and calibration of the estimates of held-out reaches.

use crate::contact::candidates::Role;
pub use hwall_contact::score::{Evaluation, Moment, REGIONS, Summary};

/// A candidate over all held-out reaches.
#[derive(Debug, Clone)]
pub struct Scores {
    /// The candidate.
    pub name: String,
    /// Its role.
    pub role: Role,
    /// Every held-out reach at every moment, without feedback about touches.
    pub alone: Evaluation,
    /// The same for the learned estimator with feedback about the person's previous touches.
    pub told: Option<Evaluation>,
    /// Time for one frame, µs, sorted.
    pub step_us: Vec<f64>,
    /// The longest training of a fold; `None` without training.
    pub training: Option<Training>,
}

/// Training time; as many folds as there are cores are trained in parallel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Training {
    /// Training reaches.
    pub reaches: usize,
    /// s.
    pub took_s: f64,
}

/// Ranges of previous touches for the learning curve: from the first number up to the second.
pub const TOUCHES: [(usize, usize); 6] =
    [(0, 1), (1, 3), (3, 6), (6, 11), (11, 26), (26, usize::MAX)];

impl Scores {
    /// Over the reaches at one moment.
    pub fn at_moment(&self, moment: Moment) -> Summary {
        self.alone.at(moment)
    }

    /// Over 30 to 90 % of the time, while an estimate is still useful.
    pub fn under_way(&self) -> Summary {
        self.alone.among(|_| true, under_way)
    }
}

/// From 30 to 90 % of the time, while an estimate is still useful.
pub fn under_way(moment: Moment) -> bool {
    matches!(moment, Moment::Share(share) if share < 0.95)
}
