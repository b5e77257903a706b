//! Targets that leap to and fro.

use crate::error::HapticsError;
use glam::DVec3;
use hwall_numeric::check::{non_negative, positive};

/// How often a target may leap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeapLimits {
    /// A target that goes this far from one cycle to the next has leapt, m; default 0.05. A shorter way counts with the cube of its
    /// share: a target that trembles by half as much may do so eight times as often.
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
pub(in crate::safety) struct TargetLeaps {
    last: Option<(DVec3, f64)>,
    count: f64,
}

impl TargetLeaps {
    /// How far the target leapt, m, if it has leapt too often; times are of sound clocks.
    pub(in crate::safety) fn step(
        &mut self,
        point_m: DVec3,
        now_s: f64,
        limits: &LeapLimits,
    ) -> Option<f64> {
        // What is no place is named by others; the next one is compared with the last that was one.
        if !point_m.is_finite() {
            return None;
        }
        let (before_m, before_s) = self.last.replace((point_m, now_s))?;
        let forgotten = limits.forgotten_per_s * (now_s - before_s).max(0.0);
        self.count = (self.count - forgotten).max(0.0);
        let by_m = point_m.distance(before_m);
        let leaps = (by_m / limits.leap_m).powi(3).min(1.0);
        // However long it leapt, soon after the last one it is forgotten.
        self.count = (self.count + leaps).min(1.1 * limits.most + 1.0);
        (self.count > limits.most).then_some(by_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The step of 1 ms in which leaps of a target are noticed.
    fn noticed(steps: usize, y_m: impl Fn(usize) -> f64) -> Option<usize> {
        let (limits, mut leaps) = (LeapLimits::default(), TargetLeaps::default());
        (0..steps).find(|k| {
            let point_m = DVec3::new(0.6, y_m(*k), 0.6);
            leaps.step(point_m, 1e-3 * *k as f64, &limits).is_some()
        })
    }

    #[test]
    fn flips_that_are_each_a_little_shorter_than_a_leap_are_noticed() {
        for flip_m in [0.049, 0.03, 0.02] {
            let k = noticed(2000, |k| if k % 2 == 0 { 0.0 } else { flip_m });
            assert!(k.is_some(), "{flip_m} m");
        }
        // The place that a tracker of 90 Hz foresees trembles, or goes along with a hand at 2 m/s.
        let frame = |k: usize| (k / 11) as f64;
        assert_eq!(noticed(20_000, |k| 0.02 * (frame(k) % 2.0)), None);
        assert_eq!(noticed(20_000, |k| 2e-3 * k as f64), None);
    }

    #[test]
    fn a_place_that_is_none_hides_no_leap() {
        let flips = |k: usize| match k % 4 {
            0 => 0.2,
            2 => -0.2,
            _ => f64::NAN,
        };
        assert!(noticed(200, flips).is_some());
    }
}
