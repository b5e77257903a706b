//! Targets that jump back and forth.

use crate::error::HapticsError;
use glam::DVec3;
use hwall_numeric::check::{non_negative, positive};

/// How often a target may jump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeapLimits {
    /// A target that moves this far in one cycle has jumped, m; default 0.05. A shorter motion counts with the cube of its ratio: a target that
    /// jitters by half as much may do so eight times as often.
    pub leap_m: f64,
    /// Number of jumps tolerated at once; default 30: eyes and predictions change their minds.
    pub most: f64,
    /// Rate at which jumps are forgotten, 1/s; default 10.
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

/// Counts jumps, and forgets them.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::safety) struct TargetLeaps {
    last: Option<(DVec3, f64)>,
    count: f64,
}

impl TargetLeaps {
    /// Size of the jump, m, if the target has jumped too often; times are of sound clocks.
    pub(in crate::safety) fn step(
        &mut self,
        point_m: DVec3,
        now_s: f64,
        limits: &LeapLimits,
    ) -> Option<f64> {
        // Another check reports a point that is not finite; the next point is compared with the last finite one.
        if !point_m.is_finite() {
            return None;
        }
        let (before_m, before_s) = self.last.replace((point_m, now_s))?;
        let forgotten = limits.forgotten_per_s * (now_s - before_s).max(0.0);
        self.count = (self.count - forgotten).max(0.0);
        let by_m = point_m.distance(before_m);
        let leaps = (by_m / limits.leap_m).powi(3).min(1.0);
        // Limit the count, so that it is forgotten soon after the last jump.
        self.count = (self.count + leaps).min(1.1 * limits.most + 1.0);
        (self.count > limits.most).then_some(by_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The 1 ms step in which a target's jumps are detected.
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
        // The prediction of a 90 Hz tracker jitters, or follows a hand at 2 m/s.
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
