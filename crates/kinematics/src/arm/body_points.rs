//! Points along the body of an arm.

use crate::jacobian::Jacobian;
use crate::joints::MOST_JOINTS;
use glam::DVec3;
use hwall_geometry::Pose;

/// Maximum number of body points: the base, one per joint, the tool.
pub const MOST_BODY_POINTS: usize = MOST_JOINTS + 2;

/// Points closer together than this are merged, m.
const SAME_M: f64 = 1e-3;

/// Points along the body of an arm from base to tool, base frame. Consecutive points bound one segment of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyPoints {
    base_from_tool: Pose,
    points_m: [DVec3; MOST_BODY_POINTS],
    count: usize,
}

impl BodyPoints {
    /// From points on the body in order, without base and tool. Drops points within 1 mm of the previous one, and all points after the
    /// seventh.
    pub fn new(places_m: impl IntoIterator<Item = DVec3>, base_from_tool: Pose) -> Self {
        let mut points = Self {
            base_from_tool,
            points_m: [DVec3::ZERO; MOST_BODY_POINTS],
            count: 1,
        };
        for place_m in places_m.into_iter().take(MOST_JOINTS) {
            points.push(place_m);
        }
        points.push(base_from_tool.position_m());
        points
    }

    fn push(&mut self, point_m: DVec3) {
        let apart_m = point_m.distance(self.points_m[self.count - 1]);
        if apart_m > SAME_M || apart_m.is_nan() {
            self.points_m[self.count] = point_m;
            self.count += 1;
        }
    }

    /// From the joint axes alone: the intersection of two neighbouring axes, or the foot of their common perpendicular on the later one.
    /// Prismatic joints give no point.
    pub(super) fn from_axes(joints: usize, (tool, jacobian): &(Pose, Jacobian)) -> Self {
        let tool_m = tool.position_m();
        let mut last = DVec3::ZERO;
        let mut before: Option<(DVec3, DVec3)> = None;
        let turning = (0..joints.min(MOST_JOINTS)).filter(|joint| {
            let axis = jacobian.angular[*joint];
            axis.length_squared() >= 0.5 || axis.is_nan()
        });
        let feet = turning.filter_map(|joint| {
            let axis = jacobian.angular[joint];
            // v = ω x r, so the axis passes through the point at -(v x ω) from the tool point.
            let on_axis = tool_m - jacobian.linear[joint].cross(axis);
            let (point, direction) = before.replace((on_axis, axis))?;
            last = foot_on_second(point, direction, on_axis, axis, last);
            Some(last)
        });
        Self::new(feet, *tool)
    }

    /// Base, body points, tool, m.
    #[must_use]
    pub fn points_m(&self) -> &[DVec3] {
        &self.points_m[..self.count]
    }

    /// Pose of the tool.
    #[must_use]
    pub const fn base_from_tool(&self) -> &Pose {
        &self.base_from_tool
    }
}

/// The point on the second line, through `q` along `v`, nearest to the first, through `p` along `u`; for parallel lines, the point nearest to
/// `last`. The directions are unit vectors; places in any one frame, m.
#[must_use]
pub fn foot_on_second(p: DVec3, u: DVec3, q: DVec3, v: DVec3, last: DVec3) -> DVec3 {
    let (b, w) = (u.dot(v), p - q);
    let determinant = 1.0 - b * b;
    let along = if determinant < 1e-9 {
        (last - q).dot(v)
    } else {
        (w.dot(v) - b * w.dot(u)) / determinant
    };
    q + v * along
}
