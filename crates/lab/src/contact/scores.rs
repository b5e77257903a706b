//! How far off the estimates of held-out reaches are, and how well they say how sure they are.

use crate::contact::candidates::Role;
pub use hwall_contact::score::{EstimateError, Evaluation, Moment, REGIONS, Summary};

/// A candidate over all held-out reaches.
#[derive(Debug, Clone)]
pub struct Scores {
    /// The candidate.
    pub name: String,
    /// What it is compared as.
    pub role: Role,
    /// At every moment of [`Moment::all`], for every reach that is that long; `None` where there was no
    /// estimate.
    pub errors: Vec<Vec<Option<EstimateError>>>,
    /// Time for one frame, µs, sorted.
    pub step_us: Vec<f64>,
    /// The longest training of a fold; `None` where nothing was trained before.
    pub training: Option<Training>,
    /// For the learned estimator: what touches teach it.
    pub adapting: Option<Adapting>,
}

/// How long learning takes; folds are trained side by side, as many as there are cores.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Training {
    /// Reaches learnt from.
    pub reaches: usize,
    /// s.
    pub took_s: f64,
}

/// The same estimator left alone, and told of each touch of a person once that is made.
#[derive(Debug, Clone, Default)]
pub struct Adapting {
    /// Never told.
    pub alone: Evaluation,
    /// Told.
    pub told: Evaluation,
}

/// Touches made before a reach, for the curve: from the first number up to the second.
pub const TOUCHES: [(usize, usize); 6] =
    [(0, 1), (1, 3), (3, 6), (6, 11), (11, 26), (26, usize::MAX)];

impl Scores {
    /// Over the reaches at the chosen moments together.
    pub fn at(&self, moments: impl Fn(Moment) -> bool) -> Summary {
        let chosen = Moment::all().zip(&self.errors).filter(|(m, _)| moments(*m));
        Summary::of(chosen.flat_map(|(_, errors)| errors).copied())
    }

    /// Over the reaches at one moment.
    pub fn at_moment(&self, moment: Moment) -> Summary {
        self.at(|m| m == moment)
    }

    /// Over 30 to 90 % of the time, while an estimate is still of use.
    pub fn under_way(&self) -> Summary {
        self.at(|m| matches!(m, Moment::Share(share) if share < 0.95))
    }
}
