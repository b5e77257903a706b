//! Targets that leap to and fro.

use crate::error::HapticsError;
use glam::DVec3;
use hwall_numeric::check::{non_negative, positive};

/// How often a target may leap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeapLimits {
    /// A target that goes further than this from one cycle to the next has leapt, m; default 0.05.
    pub leap_m: f64,
    /// So many leaps at once are borne; default 30: eyes and predictions change their minds.
    pub most: f64,
    /// So many are forgotten every second, 1/s; default 10.
    pub forgotten_per_s: f64,
}

impl Default for LeapLimits {
    fn default() -> Self {
        Self {
            leap_m: 0.05,
            most: 30.0,
            forgotten_per_s: 10.0,
        }
    }
}

impl LeapLimits {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("leap_m", self.leap_m)?;
        positive("most", self.most)?;
        non_negative("forgotten_per_s", self.forgotten_per_s)?;
        Ok(())
    }
}

/// Counts leaps, and forgets them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TargetLeaps {
    last: Option<(DVec3, f64)>,
    count: f64,
}

impl TargetLeaps {
    /// How far the target leapt, m, if it has leapt too often; times are of sound clocks.
    pub(super) fn step(&mut self, point_m: DVec3, now_s: f64, limits: &LeapLimits) -> Option<f64> {
        let (before_m, before_s) = self.last.replace((point_m, now_s))?;
        let forgotten = limits.forgotten_per_s * (now_s - before_s).max(0.0);
        self.count = (self.count - forgotten).max(0.0);
        let by_m = point_m.distance(before_m);
        if by_m > limits.leap_m {
            // However long it leapt, soon after the last one it is forgotten.
            self.count = (self.count + 1.0).min(1.1 * limits.most + 1.0);
        }
        (self.count > limits.most).then_some(by_m)
    }
}
