//! Overlap and distance of solids, found without the axes of a separating-axis test.

use glam::{DMat3, DVec3};
use hwall_kinematics::Pose;
use hwall_reachability::Plate;

/// Centre, axes as columns and half extents of a box in the base frame.
#[derive(Clone, Copy)]
pub(crate) struct Solid {
    pub(crate) centre: DVec3,
    pub(crate) axes: DMat3,
    pub(crate) half: DVec3,
}

impl Solid {
    pub(crate) fn of_box(pose: &Pose, half: DVec3) -> Self {
        Self {
            centre: pose.position_m(),
            axes: pose.rotation(),
            half,
        }
    }

    pub(crate) fn of_plate(p: Plate, tool: &Pose) -> Self {
        Self {
            centre: tool.transform_point(DVec3::new(0.0, 0.0, -p.thickness_m / 2.0)),
            axes: tool.rotation(),
            half: DVec3::new(p.half_width_m, p.half_height_m, p.thickness_m / 2.0),
        }
    }

    fn nearest(&self, p: DVec3) -> DVec3 {
        let local = self.axes.transpose() * (p - self.centre);
        self.axes * local.clamp(-self.half, self.half) + self.centre
    }

    fn support(&self, n: DVec3) -> f64 {
        n.dot(self.centre) + (self.axes.transpose() * n).abs().dot(self.half)
    }
}

/// Alternating projections: `Some(true)` if a common point is found, `Some(false)` if a separating
/// plane is found, `None` if undecided. Does not use the axes of the separating-axis test.
pub(crate) fn proven_overlap(a: Solid, b: Solid) -> Option<bool> {
    let mut p = a.centre;
    for _ in 0..3000 {
        let q = b.nearest(p);
        p = a.nearest(q);
        let gap = p - q;
        if gap.length() < 1e-13 {
            return Some(true);
        }
        if -a.support(-gap) > b.support(gap) {
            return Some(false);
        }
    }
    None
}

/// Distance from a segment to a box, which is convex along the segment.
pub(crate) fn distance_m(solid: Solid, ends: [DVec3; 2]) -> f64 {
    let at = |u: f64| {
        let p = ends[0].lerp(ends[1], u);
        p.distance(solid.nearest(p))
    };
    let (mut lo, mut hi) = (0.0, 1.0);
    for _ in 0..100 {
        let (a, b) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
        if at(a) < at(b) { hi = b } else { lo = a }
    }
    at(lo).min(at(0.0)).min(at(1.0))
}
