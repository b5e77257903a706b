//! Joint limits as tests on direction vectors, so that a verdict needs no angle.
//!
//! A joint angle is held as the direction `(x, y) = ρ (cos q, sin q)`, `ρ ≥ 0`. Whether it lies
//! within a limit is then the sign of two cross products. Each test carries the absolute
//! tolerance [`CROSS_TOLERANCE`]: near a singularity `ρ → 0` and the angle itself means
//! nothing, while what the tolerance does to the pose stays below it.

use crate::JointLimit;
use crate::srs::SrsGeometry;
use std::f64::consts::{PI, TAU};

/// Slack of the cross products: what it moves the tool by, rad (times the arm's length, m).
///
/// A few hundred times the rounding of the products, ten times below the promised 1e-12.
pub(crate) const CROSS_TOLERANCE: f64 = 1e-13;

/// The limits of all joints but the elbow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Windows {
    /// Joints 1, 3, 5, 7, which a branch may turn by half a turn.
    pub(crate) turning: [Window; 4],
    /// Joints 2 and 6, whose sign is the branch.
    pub(crate) tilting: [SignedCone; 2],
}

impl Windows {
    pub(crate) fn new(limits: &[JointLimit; 7]) -> Self {
        Self {
            turning: [0, 2, 4, 6].map(|joint| Window::new(limits[joint])),
            tilting: [1, 5].map(|joint| SignedCone::new(limits[joint])),
        }
    }
}

/// One closed limit of a joint that turns about its link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Window {
    /// `cos, sin` of the lower and upper end.
    pub(crate) min: [f64; 2],
    pub(crate) max: [f64; 2],
    /// `cos, sin` of the middle.
    middle: [f64; 2],
    pub(crate) shape: Shape,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// A full turn or more: nothing to test.
    Free,
    /// More than half a turn: outside only if beyond both ends.
    Wide,
    /// At most half a turn: inside only if within both ends.
    Narrow,
}

impl Window {
    pub(crate) fn new(limit: JointLimit) -> Self {
        let width = limit.max_rad - limit.min_rad;
        let shape = if width >= TAU {
            Shape::Free
        } else if width > PI {
            Shape::Wide
        } else {
            Shape::Narrow
        };
        let direction = |angle: f64| {
            if angle.is_finite() {
                [angle.cos(), angle.sin()]
            } else {
                [1.0, 0.0]
            }
        };
        Self {
            min: direction(limit.min_rad),
            max: direction(limit.max_rad),
            middle: direction(0.5 * (limit.min_rad + limit.max_rad)),
            shape,
        }
    }

    /// Whether the direction, and whether its opposite, lies in the window.
    #[inline(always)]
    pub(crate) fn holds(&self, x: f64, y: f64, slack: f64) -> (bool, bool) {
        let past_min = self.min[0] * y - self.min[1] * x;
        let before_max = self.max[1] * x - self.max[0] * y;
        match self.shape {
            Shape::Free => (true, true),
            Shape::Wide => (
                past_min >= -slack || before_max >= -slack,
                past_min <= slack || before_max <= slack,
            ),
            Shape::Narrow => {
                // Without the middle, a window of no width would hold its opposite too.
                let towards = self.middle[0] * x + self.middle[1] * y;
                (
                    past_min >= -slack && before_max >= -slack && towards >= -slack,
                    past_min <= slack && before_max <= slack && towards <= slack,
                )
            }
        }
    }
}

impl Window {
    /// Directions whose cross products the test compares with its slack.
    ///
    /// A narrow window's middle counts as the direction at right angles to it: with a slack that
    /// test, too, has an end of its own.
    #[inline(always)]
    pub(crate) fn slack_ends(&self) -> impl Iterator<Item = [f64; 2]> {
        let [cos, sin] = self.middle;
        let ends = match self.shape {
            Shape::Free => [None, None, None],
            Shape::Wide => [Some(self.min), Some(self.max), None],
            Shape::Narrow => [Some(self.min), Some(self.max), Some([sin, -cos])],
        };
        ends.into_iter().flatten()
    }
}

/// The limit of joint 2 or 6, split by the sign of the joint: `|q|` between two ends, each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SignedCone {
    /// For `q ≥ 0` and for `q ≤ 0`: the ends of `|q|`, or `None` where that sign is not allowed.
    pub(crate) sides: [Option<Cone>; 2],
}

/// `|q|` in `[inner, outer]`, as `cos, sin`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cone {
    pub(crate) inner: [f64; 2],
    pub(crate) outer: [f64; 2],
}

impl SignedCone {
    /// Any tilt of either sign.
    pub(crate) const FREE: Self = {
        let any = Some(Cone {
            inner: [1.0, 0.0],
            outer: [-1.0, 0.0],
        });
        Self { sides: [any, any] }
    };

    pub(crate) fn new(limit: JointLimit) -> Self {
        Self {
            sides: magnitude_ranges(limit).map(|range| range.map(Cone::new)),
        }
    }

    /// Whether `+q` and `-q` are allowed, for `q = atan2(sin, cos)`, `sin ≥ 0`.
    #[inline(always)]
    pub(crate) fn holds(&self, cos: f64, sin: f64, slack: f64) -> (bool, bool) {
        let [plus, minus] = self.sides;
        (
            plus.is_some_and(|c| c.holds(cos, sin, slack)),
            minus.is_some_and(|c| c.holds(cos, sin, slack)),
        )
    }
}

impl SignedCone {
    /// Is even the angle with the largest cosine clearly outside, whatever its sign?
    #[inline(always)]
    pub(crate) fn is_beyond(&self, largest_cos: f64) -> bool {
        let beyond = |cone: &Cone| largest_cos < cone.outer[0] - 10.0 * CROSS_TOLERANCE;
        self.sides.iter().flatten().all(beyond)
    }

    /// Is even the angle with the largest cosine outside by more than the angle whose sine is
    /// `slack`, whatever its sign?
    #[inline(always)]
    pub(crate) fn is_beyond_by(&self, largest_cos: f64, slack: f64) -> bool {
        let cos_slack = (1.0 - slack * slack).max(0.0).sqrt();
        let beyond = |cone: &Cone| {
            let [cos, sin] = cone.outer;
            // The widened end lies before half a turn, and the angle beyond it.
            sin * cos_slack + cos * slack > 0.0
                && largest_cos < cos * cos_slack - sin * slack - 10.0 * CROSS_TOLERANCE
        };
        self.sides.iter().flatten().all(beyond)
    }

    /// Cosines at which the test of an end, moved by the angle whose sine is `slack`, turns over;
    /// each once.
    #[inline(always)]
    pub(crate) fn slack_ends(&self, slack: f64) -> impl Iterator<Item = f64> {
        let cos_slack = (1.0 - slack * slack).max(0.0).sqrt();
        let mut seen = [f64::NAN; 4];
        let ends = self.sides.map(|side| {
            side.map_or([f64::NAN; 2], |cone| {
                [
                    cone.inner[0] * cos_slack + cone.inner[1] * slack,
                    cone.outer[0] * cos_slack - cone.outer[1] * slack,
                ]
            })
        });
        for (slot, end) in ends.into_iter().flatten().enumerate() {
            if end < 1.0 && !seen.contains(&end) {
                seen[slot] = end;
            }
        }
        seen.into_iter().filter(|end| !end.is_nan())
    }
}

impl Cone {
    fn new([inner, outer]: [f64; 2]) -> Self {
        Self {
            inner: [inner.cos(), inner.sin()],
            outer: [outer.cos(), outer.sin()],
        }
    }

    #[inline(always)]
    fn holds(&self, cos: f64, sin: f64, slack: f64) -> bool {
        // Both angles lie in [0, π), so each cross product is the sine of a difference below π.
        self.inner[0] * sin - self.inner[1] * cos >= -slack
            && self.outer[1] * cos - self.outer[0] * sin >= -slack
    }
}

/// The part of a limit with `q ≥ 0` and the part with `q ≤ 0`, as ranges of `|q|`.
pub(crate) fn magnitude_ranges(limit: JointLimit) -> [Option<[f64; 2]>; 2] {
    let (lo, hi) = (limit.min_rad, limit.max_rad);
    [
        (hi >= 0.0).then(|| [lo.max(0.0), hi]),
        (lo <= 0.0).then(|| [(-hi).max(0.0), -lo]),
    ]
}

/// Shoulder-wrist distances that the elbow allows: joint 4's limit, seen as lengths.
///
/// The distance falls as `|q4|` grows. Testing lengths instead of angles keeps the tolerance
/// in metres: near a straight elbow 1e-16 m is 1e-8 rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Distances {
    /// Upper arm and forearm, m.
    pub(crate) upper: f64,
    pub(crate) fore: f64,
    /// `[shortest, longest]` for `q4 ≤ 0` and for `q4 ≥ 0`; `[∞, -∞]` where not allowed.
    pub(crate) sides: [[f64; 2]; 2],
    /// `cos, sin` of `|q4|` at those ends.
    ends: [[[f64; 2]; 2]; 2],
    /// Rounding of a shoulder-wrist distance near the base, m.
    pub(crate) tolerance: f64,
}

impl Distances {
    pub(crate) fn new(geometry: SrsGeometry, elbow: JointLimit) -> Self {
        let (a, b) = (geometry.d_se_m, geometry.d_ew_m);
        // |w|² = a² + b² + 2ab cos q4, written so that a straight elbow keeps all digits.
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

    /// Longest shoulder-wrist distance the geometry gives, m.
    pub(crate) fn longest(&self) -> f64 {
        self.upper + self.fore
    }

    /// Shortest one, m.
    pub(crate) fn shortest(&self) -> f64 {
        (self.upper - self.fore).abs()
    }

    /// The length and `cos, sin` of `|q4|` of the limit that a length sits on or, by rounding,
    /// beyond; `None` strictly within the limits.
    ///
    /// Taking the limit itself instead of what the length gives back matters near a straight
    /// elbow, where a rounding of the length turns the joint by much more.
    #[inline(always)]
    pub(crate) fn limit_at(&self, length: f64, allowed: (bool, bool)) -> Option<(f64, [f64; 2])> {
        let at = |side: usize| {
            let [shortest, longest] = self.sides[side];
            if length <= shortest {
                Some((shortest, self.ends[side][0]))
            } else if length >= longest {
                Some((longest, self.ends[side][1]))
            } else {
                None
            }
        };
        match allowed {
            // The other sign, strictly within its limits, may bend as much.
            (true, true) => at(0).or_else(|| at(1)),
            (true, false) => at(0),
            (false, true) => at(1),
            (false, false) => None,
        }
    }

    /// Allowed with `q4 ≤ 0`, allowed with `q4 ≥ 0`?
    #[inline(always)]
    pub(crate) fn allow(&self, length: f64) -> (bool, bool) {
        let within = |side: [f64; 2]| {
            side[0] - self.tolerance <= length && length <= side[1] + self.tolerance
        };
        (within(self.sides[0]), within(self.sides[1]))
    }
}
