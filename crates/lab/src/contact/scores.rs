//! How far off the estimates of held-out reaches are, and how well they say how sure they are.

use crate::contact::candidates::Role;
pub use hwall_contact::score::{Evaluation, Moment, REGIONS, Summary};

/// A candidate over all held-out reaches.
#[derive(Debug, Clone)]
pub struct Scores {
    /// The candidate.
    pub name: String,
    /// What it is compared as.
    pub role: Role,
    /// Every held-out reach at every moment, never told of touches.
    pub alone: Evaluation,
    /// The learned estimator once it is told of each touch of a person that was made.
    pub told: Option<Evaluation>,
    /// Time for one frame, µs, sorted.
    pub step_us: Vec<f64>,
    /// The longest training of a fold; `None` where nothing was trained before.
    pub training: Option<Training>,
}

/// How long learning takes; folds are trained side by side, as many as there are cores.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Training {
    /// Reaches learnt from.
    pub reaches: usize,
    /// s.
    pub took_s: f64,
}

/// Touches made before a reach, for the curve: from the first number up to the second.
pub const TOUCHES: [(usize, usize); 6] =
    [(0, 1), (1, 3), (3, 6), (6, 11), (11, 26), (26, usize::MAX)];

impl Scores {
    /// Over the reaches at one moment.
    pub fn at_moment(&self, moment: Moment) -> Summary {
        self.alone.at(moment)
    }

    /// Over 30 to 90 % of the time, while an estimate is still of use.
    pub fn under_way(&self) -> Summary {
        self.alone.among(|_| true, under_way)
    }
}

/// From 30 to 90 % of the time, while an estimate is still of use.
pub fn under_way(moment: Moment) -> bool {
    matches!(moment, Moment::Share(share) if share < 0.95)
}
