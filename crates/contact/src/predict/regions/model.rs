//! Region sizes by the remaining distance of the hand.

use super::sizes::RegionSizes;

/// Number of knots of the remaining distance.
pub(super) const KNOTS: usize = 7;
/// The knots, m: denser where the hand is near.
const WAYS_M: [f64; KNOTS] = [0.0, 0.01, 0.03, 0.06, 0.12, 0.25, 0.5];
/// Offset in the logarithm by which distances are compared, m: about the noise of a tracker.
const OFFSET_M: f64 = 5e-3;

/// The regions of 50, 70 and 90 % of a fused prediction, by the remaining distance from the hand to the predicted point.
///
/// The ratio of errors to the stated covariance changes during a reach: halfway, most errors are about as stated; near the end, the hand is more
/// informative than the learned covariance assumes. The remaining distance distinguishes the phases of a reach better than the remaining time,
/// which is itself an estimate.
///
/// The sizes do not include the registration error of the tracker, which is added as configured. So the model may be
/// trained on simulated people, whose tracker is exact, and used with a real tracker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RegionModel {
    /// Logarithms of the squared distances, by remaining distance.
    pub(super) logarithms: [[f64; 3]; KNOTS],
    pub(super) touches: usize,
}

/// A remaining distance between two knots: the lower knot, and the weight of the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BetweenWays {
    pub(super) before: usize,
    pub(super) next_weight: f64,
}

impl BetweenWays {
    /// A distance that is not finite counts as the longest.
    pub(super) fn of(way_m: f64) -> Self {
        let key = |way_m: f64| (way_m + OFFSET_M).ln();
        let way_m = if way_m.is_finite() { way_m } else { 1.0 };
        let way_m = way_m.clamp(WAYS_M[0], WAYS_M[KNOTS - 1]);
        let after = WAYS_M.iter().position(|w| *w > way_m);
        let before = after.unwrap_or(KNOTS - 1).clamp(1, KNOTS - 1) - 1;
        let (from, to) = (key(WAYS_M[before]), key(WAYS_M[before + 1]));
        Self {
            before,
            next_weight: (key(way_m) - from) / (to - from),
        }
    }
}

impl RegionModel {
    /// Number of training touches.
    #[must_use]
    pub const fn touches(&self) -> usize {
        self.touches
    }

    /// The sizes at this distance of the hand from the predicted point, m, with an exact registration.
    #[must_use]
    pub fn at(&self, way_m: f64) -> RegionSizes {
        let BetweenWays {
            before,
            next_weight,
        } = BetweenWays::of(way_m);
        let (a, b) = (&self.logarithms[before], &self.logarithms[before + 1]);
        RegionSizes::from_logarithms(std::array::from_fn(|k| {
            (1.0 - next_weight) * a[k] + next_weight * b[k]
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_lie_between_the_nearest_two() {
        for (knot, way_m) in WAYS_M.into_iter().enumerate() {
            let at = BetweenWays::of(way_m);
            let found = at.before as f64 + at.next_weight;
            assert!((found - knot as f64).abs() < 1e-12, "{way_m}: {found}");
        }
        for (way_m, expected) in [
            (-1.0, 0.0),
            (9.0, 6.0),
            (f64::NAN, 6.0),
            (f64::INFINITY, 6.0),
        ] {
            let at = BetweenWays::of(way_m);
            assert!((at.before as f64 + at.next_weight - expected).abs() < 1e-12);
        }
        let half = BetweenWays::of((0.035_f64 * 0.065).sqrt() - OFFSET_M);
        assert!(half.before == 2 && (half.next_weight - 0.5).abs() < 1e-12);
    }
}
