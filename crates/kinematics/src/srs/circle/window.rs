//! Joint limits as tests on direction vectors, so that a verdict needs no angle.
//!
//! A joint angle is stored as the direction `(x, y) = ρ (cos q, sin q)`, `ρ ≥ 0`. The signs of two cross
//! products then tell whether it is within a limit. Each test has the absolute tolerance [`CROSS_TOLERANCE`]:
//! near a singularity `ρ → 0` and the angle is undefined, but the pose error stays below the tolerance.

use crate::joints::JointLimit;
use std::f64::consts::{PI, TAU};

/// Tolerance of the cross products: the tool error it allows, rad (times the arm's length, m).
///
/// A few hundred times the rounding of the products, ten times below the promised 1e-12.
pub(in crate::srs) const CROSS_TOLERANCE: f64 = 1e-13;

/// The limits of all joints except the elbow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::srs) struct Windows {
    /// Joints 1, 3, 5, 7, which a branch may rotate by half a turn.
    pub(in crate::srs) turning: [Window; 4],
    /// Joints 2 and 6, whose sign depends on the branch.
    pub(in crate::srs) tilting: [SignedCone; 2],
}

impl Windows {
    pub(in crate::srs) fn new(limits: &[JointLimit; 7]) -> Self {
        Self {
            turning: [0, 2, 4, 6].map(|joint| Window::new(limits[joint])),
            tilting: [1, 5].map(|joint| SignedCone::new(limits[joint])),
        }
    }
}

/// One closed limit of a joint that turns about its link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::srs) struct Window {
    /// `cos, sin` of the lower and upper end.
    pub(in crate::srs) min: [f64; 2],
    pub(in crate::srs) max: [f64; 2],
    /// `cos, sin` of the middle.
    middle: [f64; 2],
    pub(in crate::srs) shape: Shape,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::srs) enum Shape {
    /// A full turn or more: nothing to test.
    Free,
    /// More than half a turn: outside only if beyond both ends.
    Wide,
    /// At most half a turn: inside only if within both ends.
    Narrow,
}

impl Window {
    pub(in crate::srs) fn new(limit: JointLimit) -> Self {
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

    /// Whether the direction and its opposite lie in the window.
    #[inline(always)]
    pub(in crate::srs) fn holds(&self, x: f64, y: f64, slack: f64) -> (bool, bool) {
        let past_min = self.min[0] * y - self.min[1] * x;
        let before_max = self.max[1] * x - self.max[0] * y;
        match self.shape {
            Shape::Free => (true, true),
            Shape::Wide => (
                past_min >= -slack || before_max >= -slack,
                past_min <= slack || before_max <= slack,
            ),
            Shape::Narrow => {
                // Without the test against the middle, a window of zero width would also contain the opposite direction.
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
    /// Directions whose cross products are compared with the slack.
    ///
    /// A narrow window also gives the direction perpendicular to its middle, because with a slack that test has its own end.
    #[inline(always)]
    pub(in crate::srs) fn slack_ends(&self) -> impl Iterator<Item = [f64; 2]> {
        let [cos, sin] = self.middle;
        let ends = match self.shape {
            Shape::Free => [None, None, None],
            Shape::Wide => [Some(self.min), Some(self.max), None],
            Shape::Narrow => [Some(self.min), Some(self.max), Some([sin, -cos])],
        };
        ends.into_iter().flatten()
    }
}

/// The limit of joint 2 or 6, split by the sign of the joint into two ranges of `|q|`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::srs) struct SignedCone {
    /// For `q ≥ 0` and for `q ≤ 0`: the ends of `|q|`, or `None` where that sign is not allowed.
    pub(in crate::srs) sides: [Option<Cone>; 2],
}

/// `|q|` in `[inner, outer]`, as `cos, sin`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::srs) struct Cone {
    pub(in crate::srs) inner: [f64; 2],
    pub(in crate::srs) outer: [f64; 2],
}

impl SignedCone {
    /// Any tilt of either sign.
    pub(in crate::srs) const FREE: Self = {
        let any = Some(Cone {
            inner: [1.0, 0.0],
            outer: [-1.0, 0.0],
        });
        Self { sides: [any, any] }
    };

    pub(in crate::srs) fn new(limit: JointLimit) -> Self {
        Self {
            sides: magnitude_ranges(limit).map(|range| range.map(Cone::new)),
        }
    }

    /// Whether `+q` and `-q` are allowed, for `q = atan2(sin, cos)`, `sin ≥ 0`.
    #[inline(always)]
    pub(in crate::srs) fn holds(&self, cos: f64, sin: f64, slack: f64) -> (bool, bool) {
        let [plus, minus] = self.sides;
        (
            plus.is_some_and(|c| c.holds(cos, sin, slack)),
            minus.is_some_and(|c| c.holds(cos, sin, slack)),
        )
    }
}

impl SignedCone {
    /// True if even the angle with the largest cosine is clearly outside, for both signs.
    #[inline(always)]
    pub(in crate::srs) fn is_beyond(&self, largest_cos: f64) -> bool {
        let beyond = |cone: &Cone| largest_cos < cone.outer[0] - 10.0 * CROSS_TOLERANCE;
        self.sides.iter().flatten().all(beyond)
    }

    /// True if even the angle with the largest cosine is outside by more than the angle with sine `slack`, for both signs.
    #[inline(always)]
    pub(in crate::srs) fn is_beyond_by(&self, largest_cos: f64, slack: f64) -> bool {
        let cos_slack = (1.0 - slack * slack).max(0.0).sqrt();
        let beyond = |cone: &Cone| {
            let [cos, sin] = cone.outer;
            // The widened end is below half a turn, and the angle is beyond it.
            sin * cos_slack + cos * slack > 0.0
                && largest_cos < cos * cos_slack - sin * slack - 10.0 * CROSS_TOLERANCE
        };
        self.sides.iter().flatten().all(beyond)
    }

    /// Cosines at which the test of an end, moved by the angle with sine `slack`, changes; each once.
    #[inline(always)]
    pub(in crate::srs) fn slack_ends(&self, slack: f64) -> impl Iterator<Item = f64> {
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
pub(in crate::srs) fn magnitude_ranges(limit: JointLimit) -> [Option<[f64; 2]>; 2] {
    let (lo, hi) = (limit.min_rad, limit.max_rad);
    [
        (hi >= 0.0).then(|| [lo.max(0.0), hi]),
        (lo <= 0.0).then(|| [(-hi).max(0.0), -lo]),
    ]
}
