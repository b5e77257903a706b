//! Surfaces that the board must stay behind.

use crate::board::Board;
use crate::error::HapticsError;
use glam::DVec3;
use hwall_geometry::{Pose, direction};
use hwall_numeric::check::{all_finite, positive};

/// A board further in front of a barrier than this is on the other side of the room and not before it, m.
const DEEPEST_M: f64 = 0.3;

/// A flat part of a surface with the person on the side of its normal: the board stays behind it. Base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Barrier {
    middle_m: DVec3,
    normal: DVec3,
    /// Two directions within the surface, each as long as the surface reaches from the middle: `1 / half extent`.
    inverse_half: [DVec3; 2],
}

impl Barrier {
    /// A rectangle about a middle (m) with an outward normal (towards the person; any length but zero), horizontal and
    /// vertical half extents, m.
    ///
    /// # Errors
    /// NaN, infinity, a normal without a direction, an extent that is not positive.
    pub fn new(
        middle_m: DVec3,
        outward_normal: DVec3,
        half_extent_m: [f64; 2],
    ) -> Result<Self, HapticsError> {
        all_finite("middle_m", &middle_m.to_array())?;
        for half in half_extent_m {
            positive("half_extent_m", half)?;
        }
        let normal = direction("normal", outward_normal)?;
        let axes = crate::board::surface_axes(normal)?;
        Ok(Self {
            middle_m,
            normal,
            inverse_half: [axes[0] / half_extent_m[0], axes[1] / half_extent_m[1]],
        })
    }

    /// Distance of a point in front of the barrier, m; negative behind it, `None` beside it or far in front.
    #[must_use]
    pub fn in_front_m(&self, point_m: DVec3) -> Option<f64> {
        let off = point_m - self.middle_m;
        let front_m = off.dot(self.normal);
        let beside = self.inverse_half.iter().any(|a| off.dot(*a).abs() > 1.0);
        (!beside && front_m <= DEEPEST_M).then_some(front_m)
    }

    /// The outward normal.
    pub(super) const fn normal(&self) -> DVec3 {
        self.normal
    }

    /// How far the corners of the face and its middle come in front of the barrier, m; `None` if none of them is before
    /// or behind it.
    #[must_use]
    pub fn protrusion_m(&self, board: &Board, base_from_board: &Pose) -> Option<f64> {
        let most = self.most_in_front(board, base_from_board)?;
        Some(most.in_front_m)
    }

    /// The point of the face, of its corners and its middle, that comes furthest in front of the barrier.
    pub(super) fn most_in_front(&self, board: &Board, base_from_board: &Pose) -> Option<FacePoint> {
        let at = |(x, y): (f64, f64)| {
            let corner = DVec3::new(x * board.half_width_m, y * board.half_height_m, 0.0);
            let point_m = base_from_board.transform_point(corner);
            let in_front_m = self.in_front_m(point_m)?;
            Some(FacePoint {
                point_m,
                in_front_m,
            })
        };
        let points = [(0.0, 0.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
        let found = points.into_iter().filter_map(at);
        found.reduce(|a, b| if b.in_front_m > a.in_front_m { b } else { a })
    }
}

/// A point of the face of the board beside a barrier.
#[derive(Debug, Clone, Copy)]
pub(super) struct FacePoint {
    pub(super) point_m: DVec3,
    pub(super) in_front_m: f64,
}
