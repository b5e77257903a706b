//! What a search for the base's place by arrival is asked for.

use crate::error::ArrivalError;
use crate::waiting::WaitingConfig;
use hwall_numeric::check::that;
use hwall_reachability::PlacementConfig;

/// Which places to try, and what they are judged by.
#[derive(Debug, Clone, PartialEq)]
pub struct ArrivalPlacementConfig {
    /// Positions and headings. Without [`least_behind_m`](PlacementConfig::least_behind_m) a base must stand behind the
    /// walls of the targets that it serves: the board comes from behind.
    pub placement: PlacementConfig,
    /// How the waiting posture of each place is sought and judged.
    pub waiting: WaitingConfig,
    /// Positions that are judged by arrival: those that reach most targets; default 60.
    pub judged: usize,
    /// Of these, the best around which positions between those of the grid are tried; default 2.
    pub refined: usize,
    /// How many places to return; default 5.
    pub best: usize,
}

impl ArrivalPlacementConfig {
    /// The defaults for some positions.
    #[must_use]
    pub fn new(placement: PlacementConfig) -> Self {
        Self {
            placement,
            waiting: WaitingConfig::default(),
            judged: 60,
            refined: 2,
            best: 5,
        }
    }

    /// Rejects settings out of range.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), ArrivalError> {
        self.waiting.validate()?;
        for (what, count) in [("judged", self.judged), ("best", self.best)] {
            let some = (1..=100_000).contains(&count);
            that(some, what, count as f64, "between 1 and 100000")?;
        }
        Ok(())
    }
}
