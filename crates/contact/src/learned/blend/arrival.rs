//! Correction for hands that have almost stopped near the predicted end.

use crate::learned::quantiles::weighted_quantile;
use crate::learned::reaches::reach_track::PROGRESS;
use glam::DVec3;

/// Number of speeds at which the share is learned.
const KNOTS: usize = 6;
/// Quantiles of the speeds of decelerating hands at which the knots lie, dense at low speeds.
const QUANTILES: [f64; KNOTS] = [0.02, 0.06, 0.12, 0.2, 0.32, 0.5];
/// A hand is certainly in its final deceleration below the first of these shares of its peak speed, and certainly not above the second.
const SLOW: [f64; 2] = [0.3, 0.5];
/// Below this displacement a hand has not started yet, so it cannot be decelerating, m.
const LEAST_WAY_M: f64 = 0.02;
/// Added to speeds before their logarithms are compared, m/s.
const SPEED_OFFSET_M_PER_S: f64 = 5e-3;
/// Smaller errors are raised to this value, m.
const LEAST_ERROR_M: f64 = 2e-3;
/// A share other than 1 must lower the mean logarithm of the error by at least this much.
const WORTH: f64 = 0.02;
const SHARES: [f64; 9] = [1.0, 0.875, 0.75, 0.625, 0.5, 0.375, 0.25, 0.125, 0.0];

/// Share of the predicted remaining displacement that hands actually cover, by their speed.
///
/// A regression is linear in the speed, but the end of a motion is not: the mean remaining displacement is positive although most slow hands have
/// none. A hand that rests far from its predicted end is pausing; the share does not apply to it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(in crate::learned) struct Arrival {
    /// Ascending speeds, as [`key`].
    pub(in crate::learned) keys: [f64; KNOTS],
    /// Share of the displacement at each.
    pub(in crate::learned) shares: [f64; KNOTS],
    /// Longest displacements at which the shares apply, m.
    pub(in crate::learned) ways_m: [f64; KNOTS],
}

/// One held-out estimate.
pub(super) struct Stop {
    pub(super) progress: [f64; PROGRESS],
    pub(super) weight: f64,
    /// Present position, predicted end and true end, m.
    pub(super) now_m: DVec3,
    pub(super) said_m: DVec3,
    pub(super) end_m: DVec3,
}

fn key(speed_m_per_s: f64) -> f64 {
    (speed_m_per_s.max(0.0) + SPEED_OFFSET_M_PER_S).ln()
}

/// Certainty that a hand is in its final deceleration, 0 to 1.
fn slows(progress: &[f64; PROGRESS]) -> f64 {
    // The first sample of a reach has no speed yet.
    if progress[0] <= 0.0 || progress[1] < LEAST_WAY_M {
        return 0.0;
    }
    ((SLOW[1] - progress[3]) / (SLOW[1] - SLOW[0])).clamp(0.0, 1.0)
}

impl Arrival {
    /// No correction.
    pub(in crate::learned) const NONE: Self = Self {
        keys: [0.0; KNOTS],
        shares: [1.0; KNOTS],
        ways_m: [0.0; KNOTS],
    };

    /// From held-out estimates.
    pub(super) fn of<'a>(stops: impl Iterator<Item = &'a Stop>) -> Self {
        let slow: Vec<&Stop> = stops.filter(|s| slows(&s.progress) > 0.0).collect();
        if slow.is_empty() {
            return Self::NONE;
        }
        let weight = |s: &Stop| s.weight * slows(&s.progress);
        let keys = QUANTILES.map(|quantile| {
            weighted_quantile(
                quantile,
                slow.iter().map(|s| (key(s.progress[2]), weight(s))),
            )
        });
        let mut arrival = Self { keys, ..Self::NONE };
        for k in 0..KNOTS {
            let near = || {
                let each = slow.iter().map(|s| (*s, weight(s) * arrival.hats(s)[k]));
                each.filter(|(_, w)| *w > 0.0)
            };
            let ways = near().map(|(s, w)| (s.said_m.distance(s.now_m), w));
            let way_m = weighted_quantile(0.9, ways);
            let loss = |share: f64| {
                let (mut sum, mut total) = (0.0, f64::MIN_POSITIVE);
                for (s, w) in near() {
                    let miss_m = s.now_m.lerp(s.said_m, share).distance_squared(s.end_m);
                    sum += w * 0.5 * (miss_m + LEAST_ERROR_M * LEAST_ERROR_M).ln();
                    total += w;
                }
                sum / total
            };
            let (mut best, mut share) = (loss(1.0) - WORTH, 1.0);
            for tried in SHARES {
                let tried_loss = loss(tried);
                if tried_loss < best {
                    (best, share) = (tried_loss, tried);
                }
            }
            arrival.shares[k] = share;
            arrival.ways_m[k] = way_m;
        }
        arrival
    }

    /// Weights of the knots; their sum is below 1 above the highest speed.
    fn hats(&self, stop: &Stop) -> [f64; KNOTS] {
        self.between(key(stop.progress[2]))
    }

    fn between(&self, key: f64) -> [f64; KNOTS] {
        let mut out = [0.0; KNOTS];
        match self.keys.iter().position(|k| *k >= key) {
            Some(0) => out[0] = 1.0,
            Some(k) => {
                let share = (key - self.keys[k - 1]) / (self.keys[k] - self.keys[k - 1]).max(1e-9);
                (out[k - 1], out[k]) = (1.0 - share, share);
            }
            // Above the highest speed the weight fades within a factor of 1.5.
            None => out[KNOTS - 1] = (1.0 - (key - self.keys[KNOTS - 1]) / 0.4).max(0.0),
        }
        out
    }

    /// Corrected end of a hand that is predicted to stop at `said_m`, m.
    pub(in crate::learned) fn stop_m(
        &self,
        progress: &[f64; PROGRESS],
        now_m: DVec3,
        said_m: DVec3,
    ) -> DVec3 {
        let slows = slows(progress);
        if slows <= 0.0 {
            return said_m;
        }
        let way_m = said_m.distance(now_m);
        let hats = self.between(key(progress[2]));
        let at = hats.iter().zip(&self.shares).zip(&self.ways_m);
        let less: f64 = at
            .map(|((hat, share), typical_m)| {
                let is_near = (2.0 - way_m / typical_m.max(1e-6)).clamp(0.0, 1.0);
                hat * is_near * (1.0 - share)
            })
            .sum();
        said_m.lerp(now_m, (slows * less).clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stop(speed: f64, way_m: f64, left_m: f64) -> Stop {
        Stop {
            progress: [0.8, 0.5, speed, speed],
            weight: 1.0,
            now_m: DVec3::ZERO,
            said_m: DVec3::X * way_m,
            end_m: DVec3::X * left_m,
        }
    }

    #[test]
    fn a_hand_that_has_arrived_stays_and_one_that_pauses_goes_on() {
        // The predicted end is 10 mm ahead: slow hands have arrived, faster ones still cover it.
        let stops: Vec<Stop> = (0..200)
            .map(|k| {
                let speed = 0.29 * f64::from(k) / 200.0;
                stop(speed, 0.01, if speed < 0.08 { 0.0 } else { 0.01 })
            })
            .collect();
        let arrival = Arrival::of(stops.iter());
        let stop_m = |speed, way_m| {
            let s = stop(speed, way_m, 0.0);
            arrival.stop_m(&s.progress, s.now_m, s.said_m).x
        };
        assert!(stop_m(0.01, 0.01) < 1e-3, "{arrival:?}");
        assert!(stop_m(0.25, 0.01) > 9e-3, "{arrival:?}");
        assert_eq!(stop_m(0.01, 0.3), 0.3);
        // A starting hand is slow as well, but it moves at its peak speed so far.
        let s = Stop {
            progress: [0.1, 0.01, 0.01, 1.0],
            ..stop(0.01, 0.01, 0.3)
        };
        assert_eq!(arrival.stop_m(&s.progress, s.now_m, s.said_m), s.said_m);
    }

    #[test]
    fn nothing_is_learnt_from_nothing() {
        assert_eq!(Arrival::of([].iter()), Arrival::NONE);
        let fast = [stop(0.9, 0.1, 0.1)];
        assert_eq!(Arrival::of(fast.iter()), Arrival::NONE);
    }
}
