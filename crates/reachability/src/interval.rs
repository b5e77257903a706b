//! Closed intervals along a line, and sorted sets of them.

use serde::{Deserialize, Serialize};

/// A closed interval along a wall, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Lower end, m.
    pub lo_m: f64,
    /// Upper end, m; not below the lower one.
    pub hi_m: f64,
}

impl Interval {
    /// From its ends, m.
    #[must_use]
    pub const fn new(lo_m: f64, hi_m: f64) -> Self {
        Self { lo_m, hi_m }
    }

    /// Length, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.hi_m - self.lo_m
    }

    /// Does it hold `s_m`? NaN lies in no interval.
    #[must_use]
    pub fn contains(&self, s_m: f64) -> bool {
        self.lo_m <= s_m && s_m <= self.hi_m
    }

    /// Distance from `s_m` to the nearest point of the interval, m; 0 inside.
    #[must_use]
    pub fn distance_m(&self, s_m: f64) -> f64 {
        (self.lo_m - s_m).max(s_m - self.hi_m).max(0.0)
    }

    /// Mirrored about 0.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        Self::new(-self.hi_m, -self.lo_m)
    }
}
