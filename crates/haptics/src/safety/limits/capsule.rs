//! Does the arm run into itself?

use crate::error::HapticsError;
use glam::DVec3;
use hwall_kinematics::{ArmKinematics, JointPositions, MOST_JOINTS};
use hwall_numeric::check::{non_negative, positive};

/// A segment with a radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    /// One end of the segment, m.
    pub from_m: DVec3,
    /// The other end, m.
    pub to_m: DVec3,
    /// m.
    pub radius_m: f64,
}

impl Capsule {
    /// Distance between the surfaces of two capsules, m; below zero where they overlap (by the depth of the segments' nearest
    /// points). NaN in gives NaN.
    ///
    /// Error: below 1e-12 of the sizes against a search of the two parameters (tests/safety_geometry.rs).
    /// Source: [Ericson 2005], section 5.1.9.
    #[must_use]
    pub fn distance_m(&self, other: &Self) -> f64 {
        segment_distance_m(self.from_m, self.to_m, other.from_m, other.to_m)
            - self.radius_m
            - other.radius_m
    }
}

/// Distance between two segments, m.
fn segment_distance_m(p0: DVec3, p1: DVec3, q0: DVec3, q1: DVec3) -> f64 {
    let (u, v, w) = (p1 - p0, q1 - q0, p0 - q0);
    let (a, b, c) = (u.length_squared(), u.dot(v), v.length_squared());
    let (d, e) = (u.dot(w), v.dot(w));
    let at = |s: f64, t: f64| (w + u * s - v * t).length();
    let on_q = |s: f64| {
        if c > 0.0 {
            ((e + b * s) / c).clamp(0.0, 1.0)
        } else {
            0.0
        }
    };
    let on_p = |t: f64| {
        if a > 0.0 {
            ((b * t - d) / a).clamp(0.0, 1.0)
        } else {
            0.0
        }
    };
    // The nearest pair is inside both segments, or one of its points is an end.
    let determinant = a * c - b * b;
    let inner = if determinant > 1e-14 * a * c {
        let s = ((b * e - c * d) / determinant).clamp(0.0, 1.0);
        let t = on_q(s);
        at(on_p(t), t)
    } else {
        f64::INFINITY
    };
    let ends = [
        at(0.0, on_q(0.0)),
        at(1.0, on_q(1.0)),
        at(on_p(0.0), 0.0),
        at(on_p(1.0), 1.0),
    ];
    let least = ends.into_iter().fold(inner, f64::min);
    // `f64::min` drops NaN.
    if at(0.0, 0.0).is_nan() || at(1.0, 1.0).is_nan() {
        f64::NAN
    } else {
        least
    }
}

/// Settings of [`ArmCapsules`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CapsuleConfig {
    /// Radius of the links, m; default 0.09, roughly that of an iiwa.
    pub radius_m: f64,
    /// Radius of a ball about the middle of the tool, m; default 0.145, which holds the face of a board of 0.2 m.
    pub tool_radius_m: f64,
    /// Parts keep this distance, m; default 0.01.
    pub clearance_m: f64,
}

impl Default for CapsuleConfig {
    fn default() -> Self {
        Self {
            radius_m: 0.09,
            tool_radius_m: 0.145,
            clearance_m: 0.01,
        }
    }
}

impl CapsuleConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("radius_m", self.radius_m)?;
        non_negative("tool_radius_m", self.tool_radius_m)?;
        non_negative("clearance_m", self.clearance_m)?;
        Ok(())
    }
}

/// Most capsules of an arm: one between two neighbouring joints, and the tool.
const MOST: usize = MOST_JOINTS + 2;
/// Points nearer to each other than this are one, m.
const SAME_M: f64 = 1e-3;

/// An arm as capsules from base to tool.
///
/// The ends are found from the joint axes alone (the columns of the Jacobian), so this works for any [`ArmKinematics`]:
/// where two neighbouring axes meet, there is an end; where they do not, the end is the foot of their common perpendicular on
/// the later one. For an S-R-S arm these are base, shoulder, elbow, wrist and tool. A sliding joint has no axis and
/// gives no end. Offsets along an axis of an arm whose axes are far from its body need a larger radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmCapsules {
    capsules: [Capsule; MOST],
    count: usize,
}

impl ArmCapsules {
    /// At a configuration; the base is at the origin. Does not allocate. NaN in gives NaN distances.
    #[must_use]
    pub fn new(arm: &dyn ArmKinematics, q: &JointPositions, config: &CapsuleConfig) -> Self {
        let (tool, jacobian) = arm.forward_and_jacobian(q);
        let tool_m = tool.position_m();
        let mut points = [DVec3::ZERO; MOST];
        let mut count = 1;
        let mut push = |point: DVec3, points: &mut [DVec3; MOST]| {
            let apart_m = point.distance(points[count - 1]);
            if count < MOST && (apart_m > SAME_M || apart_m.is_nan()) {
                points[count] = point;
                count += 1;
            }
            points[count - 1]
        };
        let mut last = DVec3::ZERO;
        let mut before: Option<(DVec3, DVec3)> = None;
        for joint in 0..arm.joint_count().min(MOST_JOINTS) {
            let axis = jacobian.angular[joint];
            if axis.length_squared() < 0.5 {
                continue;
            }
            // v = ω x r, so the axis passes the tool point at -(v x ω) from it.
            let on_axis = tool_m - jacobian.linear[joint].cross(axis);
            if let Some((point, direction)) = before {
                let foot = foot_on_second(point, direction, on_axis, axis, last);
                last = push(foot, &mut points);
            }
            before = Some((on_axis, axis));
        }
        push(tool_m, &mut points);
        let nothing = Capsule {
            from_m: DVec3::ZERO,
            to_m: DVec3::ZERO,
            radius_m: 0.0,
        };
        let mut capsules = [nothing; MOST];
        for (i, capsule) in capsules.iter_mut().enumerate().take(count - 1) {
            *capsule = Capsule {
                from_m: points[i],
                to_m: points[i + 1],
                radius_m: config.radius_m,
            };
        }
        capsules[count - 1] = Capsule {
            from_m: tool_m,
            to_m: tool_m,
            radius_m: config.tool_radius_m,
        };
        Self { capsules, count }
    }

    /// The links from the base on, the tool last.
    #[must_use]
    pub fn capsules(&self) -> &[Capsule] {
        &self.capsules[..self.count]
    }

    /// Least distance between two parts that do not touch by construction, m: links with at least one other between them,
    /// and the tool with all links but the last two. Parts with less between them than their radii, as the short links of a
    /// wrist, touch by construction, too. Infinite where there are none.
    #[must_use]
    pub fn least_distance_m(&self) -> f64 {
        let capsules = self.capsules();
        let tool = self.count - 1;
        let mut least = f64::INFINITY;
        for (i, first) in capsules.iter().enumerate() {
            let mut between_m = 0.0;
            for (j, second) in capsules.iter().enumerate().skip(i + 2) {
                let last = &capsules[j - 1];
                between_m += last.from_m.distance(last.to_m);
                let always = between_m <= first.radius_m + second.radius_m;
                if always || (j == tool && i + 2 >= tool) {
                    continue;
                }
                let distance = first.distance_m(second);
                if distance.is_nan() {
                    return f64::NAN;
                }
                least = least.min(distance);
            }
        }
        least
    }
}

/// The point of the second line that is nearest to the first; of parallel ones that nearest to `last`.
fn foot_on_second(p: DVec3, u: DVec3, q: DVec3, v: DVec3, last: DVec3) -> DVec3 {
    let (b, w) = (u.dot(v), p - q);
    let determinant = 1.0 - b * b;
    let along = if determinant < 1e-9 {
        (last - q).dot(v)
    } else {
        (w.dot(v) - b * w.dot(u)) / determinant
    };
    q + v * along
}
