//! How far all limits can shrink before a pose becomes unreachable.

use crate::joints::JointLimit;
use crate::srs::model::SrsArm;
use hwall_geometry::Pose;
use std::f64::consts::PI;

/// Limits are widened by at most this for an unreachable pose, rad.
const WIDEST_RAD: f64 = 1.0;

impl SrsArm {
    /// The largest angle δ (rad) by which both ends of every joint limit can move inwards with the
    /// pose still reachable; negative where the limits must be widened by `-δ`; `None` where the
    /// links are too short or too long, or the limits would have to be widened by more than 1 rad.
    ///
    /// By bisection on the exact verdict, which is monotone in δ. Error: below 1e-12 rad, except
    /// within 1e-7 of a straight elbow, where the pose itself fixes joint 4 to 1e-8 rad only.
    #[must_use]
    pub fn joint_margin_rad(&self, base_from_tool: &Pose) -> Option<f64> {
        let narrowest = self
            .limits()
            .iter()
            .fold(f64::INFINITY, |m, l| m.min(0.5 * (l.max_rad - l.min_rad)));
        let holds = |by_rad: f64| {
            self.with_limits(self.limits().map(|l| moved(l, by_rad)))
                .is_ok_and(|arm| arm.is_reachable(base_from_tool))
        };
        let (mut inside, mut outside) = if holds(0.0) {
            (0.0, narrowest.min(PI))
        } else if holds(-WIDEST_RAD) {
            (-WIDEST_RAD, 0.0)
        } else {
            return None;
        };
        if holds(outside) {
            return Some(outside);
        }
        while outside - inside > 1e-13 {
            let middle = 0.5 * (inside + outside);
            if middle <= inside || middle >= outside {
                break;
            }
            if holds(middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        Some(inside)
    }
}

/// A limit moved inwards. Joints 2, 4 and 6 stay within half a turn when limits widen.
fn moved(limit: JointLimit, by_rad: f64) -> JointLimit {
    let JointLimit { min_rad, max_rad } = limit.shrunk(by_rad);
    let within_half_turn = limit.min_rad > -PI && limit.max_rad < PI;
    if by_rad < 0.0 && within_half_turn {
        // Half a turn would be invalid for these joints; this end differs from the true widening by
        // less than 1e-12 rad of range.
        let end = PI - 5e-13;
        return JointLimit::new(min_rad.max(-end), max_rad.min(end));
    }
    if min_rad > max_rad {
        let middle = 0.5 * (min_rad + max_rad);
        return JointLimit::new(middle, middle);
    }
    JointLimit::new(min_rad, max_rad)
}
