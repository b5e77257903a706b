//! Surfaces that the board must stay behind.

pub(super) mod links;
pub(super) mod tree;

use crate::board::{Board, surface_axes};
use crate::error::HapticsError;
use glam::{DVec3, Vec3A};
use hwall_geometry::{Pose, direction};
use hwall_numeric::check::{all_finite, positive};
use obvhs::aabb::Aabb;

/// A flat part of a surface, in the base frame. Its normal points to the person; the board stays behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Barrier {
    middle_m: DVec3,
    normal: DVec3,
    /// Unit directions within the surface.
    axes: [DVec3; 2],
    half_extent_m: [f64; 2],
}

impl Barrier {
    /// A rectangle with a centre (m), an outward normal (towards the person; any length but zero), and horizontal and vertical half extents, m.
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
        Ok(Self {
            middle_m,
            normal,
            axes: surface_axes(normal)?,
            half_extent_m,
        })
    }

    /// Its centre, m.
    #[must_use]
    pub const fn middle_m(&self) -> DVec3 {
        self.middle_m
    }

    /// Unit normal, towards the person.
    #[must_use]
    pub const fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Horizontal and vertical half extents, m.
    #[must_use]
    pub const fn half_extent_m(&self) -> [f64; 2] {
        self.half_extent_m
    }

    /// Its bounding box, padded so that rounding to single precision leaves nothing out.
    pub(in crate::motion) fn padded_box(&self) -> Aabb {
        let [x, y] = [0, 1].map(|i| self.axes[i].abs() * self.half_extent_m[i]);
        let pad = (self.middle_m.abs() + x + y + 1.0) * f64::from(4.0 * f32::EPSILON);
        let half_m = x + y + pad;
        // Such distant corners do not fit single precision, and no arm is near them.
        let corner = |m: DVec3| Vec3A::from(m.clamp(-FAR_M, FAR_M).as_vec3());
        Aabb::new(
            corner(self.middle_m - half_m),
            corner(self.middle_m + half_m),
        )
    }

    /// Distance of a point in front of the plane, m.
    pub(in crate::motion) fn in_front_m(&self, point_m: DVec3) -> f64 {
        (point_m - self.middle_m).dot(self.normal)
    }

    /// Signed distance in front of the plane, m, and distance beside the rectangle, m.
    pub(in crate::motion) fn place_of(&self, point_m: DVec3) -> Beside {
        let off = point_m - self.middle_m;
        let beyond = |i: usize| (off.dot(self.axes[i]).abs() - self.half_extent_m[i]).max(0.0);
        Beside {
            in_front_m: off.dot(self.normal),
            beside_m: beyond(0).hypot(beyond(1)),
        }
    }

    /// Does a plane through a point coincide with this one there?
    pub(in crate::motion) fn is_at(&self, point_m: DVec3, normal: DVec3) -> bool {
        let place = self.place_of(point_m);
        place.beside_m == 0.0
            && place.in_front_m.abs() <= SAME_PLANE_M
            && self.normal.dot(normal) >= SAME_PLANE_COS
    }
}

/// A plane this close to a barrier is that barrier, m and as a cosine.
pub(in crate::motion) const SAME_PLANE_M: f64 = 1e-3;
const SAME_PLANE_COS: f64 = 0.9999;
/// Distances that differ by less belong to a common edge, m.
pub(in crate::motion) const EDGE_M: f64 = 1e-9;

/// Largest coordinate of a box corner, m.
const FAR_M: DVec3 = DVec3::splat(1e30);

/// Position of a point relative to a rectangle.
#[derive(Debug, Clone, Copy)]
pub(in crate::motion) struct Beside {
    pub(in crate::motion) in_front_m: f64,
    beside_m: f64,
}

impl Beside {
    pub(in crate::motion) fn distance_m(self) -> f64 {
        self.in_front_m.hypot(self.beside_m)
    }
}

/// The face of the board at a place that it serves or served. Over it, only a point in front of that face is in front; around it, a point may be in
/// front of other surfaces by its distance from the outer edge of the margin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::motion) struct Footprint {
    face: Pose,
    half_m: [f64; 2],
    margin_m: f64,
}

impl Footprint {
    /// The face and a margin around it.
    pub(in crate::motion) fn new(face: Pose, board: &Board, margin_m: f64) -> Self {
        Self {
            face,
            half_m: [board.half_width_m, board.half_height_m],
            margin_m,
        }
    }

    /// The same after the world has moved.
    pub(in crate::motion) fn carried(&self, moved: &Pose) -> Self {
        Self {
            face: *moved * self.face,
            ..*self
        }
    }

    /// Is a face so near that some of its points are eased, or may be soon?
    pub(in crate::motion) fn is_under(&self, board: &Board, face: &Pose) -> bool {
        corners_and_middle(board, face).into_iter().any(|point_m| {
            let p = self.face.inverse_transform_point(point_m);
            let beyond_m = (p.x.abs() - self.half_m[0]).max(p.y.abs() - self.half_m[1]);
            beyond_m.max(p.z.abs()) < self.margin_m
        })
    }

    /// How far a point is beside the face, the larger of both axes, m; negative over it.
    pub(in crate::motion) fn beyond_m(&self, point_m: DVec3) -> f64 {
        let p = self.face.inverse_transform_point(point_m);
        (p.x.abs() - self.half_m[0]).max(p.y.abs() - self.half_m[1])
    }

    /// How far a point is in front of the plane of the face, m.
    pub(in crate::motion) fn before_face_m(&self, point_m: DVec3) -> f64 {
        self.face.inverse_transform_point(point_m).z
    }

    pub(in crate::motion) const fn margin_m(&self) -> f64 {
        self.margin_m
    }

    /// The eased position of a point in front of its nearest surface; `None` beyond the margin.
    pub(in crate::motion) fn eased(&self, found: FacePoint) -> Option<FacePoint> {
        // Behind a surface there is nothing to ease.
        if found.in_front_m <= 0.0 {
            return None;
        }
        let p = self.face.inverse_transform_point(found.point_m);
        let [x, y] = [p.x, p.y];
        let beyond_m = (x.abs() - self.half_m[0])
            .max(y.abs() - self.half_m[1])
            .max(0.0);
        let eased_m = found.in_front_m - (self.margin_m - beyond_m);
        let before_face = FacePoint {
            normal: self.face.rotation().z_axis,
            in_front_m: p.z,
            ..found
        };
        if beyond_m >= self.margin_m {
            None
        } else if beyond_m <= EDGE_M || p.z >= eased_m {
            Some(before_face)
        } else {
            Some(FacePoint {
                in_front_m: eased_m,
                ..found
            })
        }
    }
}

/// A point of the board's face relative to a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::motion) struct FacePoint {
    pub(in crate::motion) point_m: DVec3,
    /// Normal of the nearest surface.
    pub(in crate::motion) normal: DVec3,
    /// Negative behind it, m.
    pub(in crate::motion) in_front_m: f64,
}

impl FacePoint {
    pub(in crate::motion) fn or_further(self, other: Self) -> Self {
        match other.in_front_m > self.in_front_m {
            true => other,
            false => self,
        }
    }
}

/// Centre and corners of the face; `None` where no surface is known.
pub(in crate::motion) type FacePoints = [Option<FacePoint>; 5];

/// Centre and corners of a face, m.
pub(in crate::motion) fn corners_and_middle(board: &Board, face: &Pose) -> [DVec3; 5] {
    let points = [
        (0.0, 0.0),
        (1.0, 1.0),
        (1.0, -1.0),
        (-1.0, 1.0),
        (-1.0, -1.0),
    ];
    points.map(|(x, y): (f64, f64)| {
        face.transform_point(DVec3::new(
            x * board.half_width_m,
            y * board.half_height_m,
            0.0,
        ))
    })
}

/// A plane around a place that the board serves, where no barrier is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::motion) struct Plane {
    pub(in crate::motion) point_m: DVec3,
    /// Unit normal.
    pub(in crate::motion) normal: DVec3,
    pub(in crate::motion) radius_m: f64,
}

impl Plane {
    /// How far the points near the place are in front, m; negative if all are behind.
    pub(in crate::motion) fn most_in_front_m(&self, points_m: &[DVec3]) -> f64 {
        let sides = points_m.iter().filter_map(|point_m| self.side(*point_m));
        sides.fold(f64::NEG_INFINITY, |most, side| most.max(side.in_front_m))
    }

    pub(in crate::motion) fn side(&self, point_m: DVec3) -> Option<FacePoint> {
        let off = point_m - self.point_m;
        (off.length() <= self.radius_m).then_some(FacePoint {
            point_m,
            normal: self.normal,
            in_front_m: off.dot(self.normal),
        })
    }
}
