//! Joint 4's limit as shoulder-wrist distances.

use super::triangle::ElbowEnd;
use super::window::magnitude_ranges;
use crate::joints::JointLimit;
use crate::srs::parameters::SrsGeometry;

/// Shoulder-wrist distances that the elbow allows: joint 4's limit as lengths.
///
/// The distance falls as `|q4|` grows. Testing lengths instead of angles keeps the tolerance
/// in metres: near a straight elbow 1e-16 m is 1e-8 rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::srs) struct Distances {
    /// Upper arm and forearm, m.
    pub(in crate::srs) upper: f64,
    pub(in crate::srs) fore: f64,
    /// `[shortest, longest]` for `q4 ≤ 0` and for `q4 ≥ 0`; `[∞, -∞]` where not allowed.
    pub(in crate::srs) sides: [[f64; 2]; 2],
    /// `cos, sin` of `|q4|` at those ends.
    ends: [[[f64; 2]; 2]; 2],
    /// Rounding of a shoulder-wrist distance near the base, m.
    pub(in crate::srs) tolerance: f64,
}

impl Distances {
    pub(in crate::srs) fn new(geometry: SrsGeometry, elbow: JointLimit) -> Self {
        let (a, b) = (geometry.d_se_m, geometry.d_ew_m);
        // |w|² = a² + b² + 2ab cos q4, in a form that is exact near a straight elbow.
        let length = |q: f64| {
            let half = (0.5 * q).sin();
            ((a + b) * (a + b) - 4.0 * a * b * half * half)
                .max(0.0)
                .sqrt()
        };
        let [plus, minus] = magnitude_ranges(elbow);
        let sides = [minus, plus].map(|range| match range {
            Some([inner, outer]) => [length(outer), length(inner)],
            None => [f64::INFINITY, f64::NEG_INFINITY],
        });
        let direction = |q: f64| [q.cos(), q.sin()];
        let ends = [minus, plus].map(|range| {
            let [inner, outer] = range.unwrap_or([0.0; 2]);
            [direction(outer), direction(inner)]
        });
        let reach = geometry.d_bs_m.abs() + a + b + geometry.d_wf_m.abs();
        Self {
            upper: a,
            fore: b,
            sides,
            ends,
            tolerance: 32.0 * f64::EPSILON * reach,
        }
    }

    /// Longest shoulder-wrist distance of the geometry, m.
    pub(in crate::srs) fn longest(&self) -> f64 {
        self.upper + self.fore
    }

    /// Shortest shoulder-wrist distance of the geometry, m.
    pub(in crate::srs) fn shortest(&self) -> f64 {
        (self.upper - self.fore).abs()
    }

    /// The limit that a length is on or, by rounding, beyond; `None` strictly within the limits.
    ///
    /// Near a straight elbow use the limit itself, not the angle recomputed from the length:
    /// rounding of the length is amplified in the joint angle.
    #[inline(always)]
    pub(in crate::srs) fn limit_at(&self, length: f64, allowed: (bool, bool)) -> Option<ElbowEnd> {
        let end = |side: usize, end: usize| ElbowEnd {
            length: self.sides[side][end],
            elbow: self.ends[side][end],
        };
        let at = |side: usize| {
            let [shortest, longest] = self.sides[side];
            if length <= shortest {
                Some(end(side, 0))
            } else if length >= longest {
                Some(end(side, 1))
            } else {
                None
            }
        };
        match allowed {
            // The other sign may be strictly within its limits at the same bend.
            (true, true) => at(0).or_else(|| at(1)),
            (true, false) => at(0),
            (false, true) => at(1),
            (false, false) => None,
        }
    }

    /// Whether the length is allowed with `q4 ≤ 0` and with `q4 ≥ 0`.
    #[inline(always)]
    pub(in crate::srs) fn allow(&self, length: f64) -> (bool, bool) {
        let within = |side: [f64; 2]| {
            side[0] - self.tolerance <= length && length <= side[1] + self.tolerance
        };
        (within(self.sides[0]), within(self.sides[1]))
    }
}
