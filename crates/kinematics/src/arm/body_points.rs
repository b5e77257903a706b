//! Points along the body of an arm.

use crate::jacobian::Jacobian;
use crate::joints::MOST_JOINTS;
use glam::DVec3;
use hwall_geometry::Pose;

/// Most points of a body: the base, one at each joint, the tool.
pub const MOST_BODY_POINTS: usize = MOST_JOINTS + 2;

/// Points nearer to each other than this are one, m.
const SAME_M: f64 = 1e-3;

/// Points in a row.
#[derive(Debug)]
pub(super) struct BodyPoints {
    points_m: [DVec3; MOST_BODY_POINTS],
    count: usize,
}

impl BodyPoints {
    /// The base alone.
    pub(super) const fn from_base() -> Self {
        Self {
            points_m: [DVec3::ZERO; MOST_BODY_POINTS],
            count: 1,
        }
    }

    /// Adds a point, unless it is the last one; returns the last.
    pub(super) fn push(&mut self, point_m: DVec3) -> DVec3 {
        let apart_m = point_m.distance(self.points_m[self.count - 1]);
        if self.count < MOST_BODY_POINTS && (apart_m > SAME_M || apart_m.is_nan()) {
            self.points_m[self.count] = point_m;
            self.count += 1;
        }
        self.points_m[self.count - 1]
    }

    pub(super) const fn finish(self) -> ([DVec3; MOST_BODY_POINTS], usize) {
        (self.points_m, self.count)
    }
}

/// From the joint axes alone, which are the columns of the Jacobian. A sliding joint has no axis and gives no point.
pub(super) fn points_from_axes(
    joints: usize,
    (tool, jacobian): &(Pose, Jacobian),
) -> ([DVec3; MOST_BODY_POINTS], usize) {
    let tool_m = tool.position_m();
    let mut points = BodyPoints::from_base();
    let mut last = DVec3::ZERO;
    let mut before: Option<(DVec3, DVec3)> = None;
    for joint in 0..joints.min(MOST_JOINTS) {
        let axis = jacobian.angular[joint];
        if axis.length_squared() < 0.5 {
            continue;
        }
        // v = ω x r, so the axis passes the tool point at -(v x ω) from it.
        let on_axis = tool_m - jacobian.linear[joint].cross(axis);
        if let Some((point, direction)) = before {
            last = points.push(foot_on_second(point, direction, on_axis, axis, last));
        }
        before = Some((on_axis, axis));
    }
    points.push(tool_m);
    points.finish()
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
