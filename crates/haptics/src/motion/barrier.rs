//! Surfaces that the board must stay behind.

use crate::board::{Board, surface_axes};
use crate::error::HapticsError;
use glam::DVec3;
use hwall_geometry::{Pose, direction};
use hwall_numeric::check::{all_finite, positive};

/// A flat part of a surface with the person on the side of its normal: the board stays behind it. Base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Barrier {
    middle_m: DVec3,
    normal: DVec3,
    /// Unit directions within the surface.
    axes: [DVec3; 2],
    half_extent_m: [f64; 2],
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
        Ok(Self {
            middle_m,
            normal,
            axes: surface_axes(normal)?,
            half_extent_m,
        })
    }

    /// Its middle, m.
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

    /// Distance of a point in front of the plane, m.
    pub(super) fn in_front_m(&self, point_m: DVec3) -> f64 {
        (point_m - self.middle_m).dot(self.normal)
    }

    /// Distance of a point in front of the plane, m, and how far it is beside the rectangle, m.
    pub(super) fn place_of(&self, point_m: DVec3) -> Beside {
        let off = point_m - self.middle_m;
        let beyond = |i: usize| (off.dot(self.axes[i]).abs() - self.half_extent_m[i]).max(0.0);
        Beside {
            in_front_m: off.dot(self.normal),
            beside_m: beyond(0).hypot(beyond(1)),
        }
    }

    /// Does a plane through a point coincide with this one there?
    fn is_at(&self, point_m: DVec3, normal: DVec3) -> bool {
        let place = self.place_of(point_m);
        place.beside_m == 0.0
            && place.in_front_m.abs() <= SAME_PLANE_M
            && self.normal.dot(normal) >= SAME_PLANE_COS
    }
}

/// A plane this near to a barrier is that barrier, m and as a cosine.
const SAME_PLANE_M: f64 = 1e-3;
const SAME_PLANE_COS: f64 = 0.9999;
/// Distances that differ by less are those to a common edge, m.
const EDGE_M: f64 = 1e-9;

/// Where a point is with regard to a rectangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beside {
    pub(super) in_front_m: f64,
    beside_m: f64,
}

impl Beside {
    pub(super) fn distance_m(self) -> f64 {
        self.in_front_m.hypot(self.beside_m)
    }
}

/// The face of the board at a place that it serves or served: over it, only what is before that face is in front; around it,
/// a point may be before other surfaces by what it is inside the margin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Footprint {
    face: Pose,
    half_m: [f64; 2],
    margin_m: f64,
}

impl Footprint {
    /// The face and a margin around it.
    pub(super) fn new(face: Pose, board: &Board, margin_m: f64) -> Self {
        Self {
            face,
            half_m: [board.half_width_m, board.half_height_m],
            margin_m,
        }
    }

    /// The same carried along with a world that moved.
    pub(super) fn carried(&self, moved: &Pose) -> Self {
        Self {
            face: *moved * self.face,
            ..*self
        }
    }

    /// Is a face so near that some of its points are eased, or may be before long?
    pub(super) fn is_under(&self, board: &Board, face: &Pose) -> bool {
        corners_and_middle(board, face).into_iter().any(|point_m| {
            let p = self.face.inverse_transform_point(point_m);
            let beyond_m = (p.x.abs() - self.half_m[0]).max(p.y.abs() - self.half_m[1]);
            beyond_m.max(p.z.abs()) < self.margin_m
        })
    }

    /// How far a point is beside the face, the larger of both ways, m; below zero over it.
    pub(super) fn beyond_m(&self, point_m: DVec3) -> f64 {
        let p = self.face.inverse_transform_point(point_m);
        (p.x.abs() - self.half_m[0]).max(p.y.abs() - self.half_m[1])
    }

    /// How far a point is before the plane of the face, m.
    pub(super) fn before_face_m(&self, point_m: DVec3) -> f64 {
        self.face.inverse_transform_point(point_m).z
    }

    pub(super) const fn margin_m(&self) -> f64 {
        self.margin_m
    }

    /// What a point that is so far before the nearest surface counts as; `None` beyond the margin.
    fn eased(&self, found: FacePoint) -> Option<FacePoint> {
        // Behind a surface nothing is to be eased.
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

/// A point of the face of the board beside a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FacePoint {
    pub(super) point_m: DVec3,
    /// Of the surface that it is nearest to.
    pub(super) normal: DVec3,
    /// Negative behind it, m.
    pub(super) in_front_m: f64,
}

impl FacePoint {
    fn or_further(self, other: Self) -> Self {
        match other.in_front_m > self.in_front_m {
            true => other,
            false => self,
        }
    }
}

/// Middle and corners of the face; `None` where no surface is known.
pub(super) type FacePoints = [Option<FacePoint>; 5];

/// Middle and corners of a face, m.
pub(super) fn corners_and_middle(board: &Board, face: &Pose) -> [DVec3; 5] {
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

/// All surfaces that the board stays behind.
#[derive(Debug, Clone, Default)]
pub(super) struct Barriers {
    all: Vec<Barrier>,
}

impl Barriers {
    pub(super) fn all(&self) -> &[Barrier] {
        &self.all
    }

    /// So many will be set without an allocation.
    pub(super) fn reserve(&mut self, count: usize) {
        self.all.reserve(count.saturating_sub(self.all.len()));
    }

    pub(super) fn set(&mut self, barriers: &[Barrier]) {
        self.all.clear();
        self.all.extend_from_slice(barriers);
    }

    /// Is a plane through a point one of the barriers?
    pub(super) fn have(&self, point_m: DVec3, normal: DVec3) -> bool {
        self.all
            .iter()
            .any(|barrier| barrier.is_at(point_m, normal))
    }

    /// The point of the face that comes furthest in front of the surfaces, of its corners and its middle, see
    /// [`all_in_front`](Self::all_in_front).
    pub(super) fn most_in_front(
        &self,
        board: &Board,
        face: &Pose,
        footprints: &[Option<Footprint>],
        planes: &[Option<Plane>],
    ) -> Option<FacePoint> {
        let all = self.all_in_front(board, face, footprints, planes);
        all.into_iter().flatten().reduce(FacePoint::or_further)
    }

    /// Where corners and middle of the face are with regard to the surfaces, eased by footprints. Besides the barriers, planes
    /// count that end nowhere.
    ///
    /// The surface nearest to a point decides on which side the point is, as for a closed mesh: next to a shelf the board is
    /// behind the wall, not beside the shelf.
    pub(super) fn all_in_front(
        &self,
        board: &Board,
        face: &Pose,
        footprints: &[Option<Footprint>],
        planes: &[Option<Plane>],
    ) -> FacePoints {
        corners_and_middle(board, face).map(|point_m| {
            let of_scene = self.nearest(point_m).map(|found| {
                let eased = footprints.iter().flatten().filter_map(|f| f.eased(found));
                eased.fold(
                    found,
                    |a, b| if b.in_front_m < a.in_front_m { b } else { a },
                )
            });
            let of_planes = planes
                .iter()
                .flatten()
                .filter_map(|plane| plane.side(point_m));
            of_scene
                .into_iter()
                .chain(of_planes)
                .reduce(FacePoint::or_further)
        })
    }

    /// On which side of the nearest surface is a point?
    fn nearest(&self, point_m: DVec3) -> Option<FacePoint> {
        let mut nearest: Option<(Beside, DVec3)> = None;
        for barrier in &self.all {
            let place = barrier.place_of(point_m);
            let nearer = nearest.is_none_or(|(least, _)| {
                let less_m = least.distance_m() - place.distance_m();
                // Beyond a common edge the surface that faces the point decides.
                let faces = place.in_front_m.abs() > least.in_front_m.abs();
                less_m > EDGE_M || (less_m >= -EDGE_M && faces)
            });
            if nearer {
                nearest = Some((place, barrier.normal));
            }
        }
        let (place, normal) = nearest?;
        Some(FacePoint {
            point_m,
            normal,
            in_front_m: place.in_front_m,
        })
    }
}

/// A plane about a place that the board serves, where no barrier is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plane {
    pub(super) point_m: DVec3,
    /// Unit normal.
    pub(super) normal: DVec3,
    pub(super) radius_m: f64,
}

impl Plane {
    /// How far the points beside the place are in front, m; negative if all are behind.
    pub(super) fn most_in_front_m(&self, points_m: &[DVec3]) -> f64 {
        let sides = points_m.iter().filter_map(|point_m| self.side(*point_m));
        sides.fold(f64::NEG_INFINITY, |most, side| most.max(side.in_front_m))
    }

    fn side(&self, point_m: DVec3) -> Option<FacePoint> {
        let off = point_m - self.point_m;
        (off.length() <= self.radius_m).then_some(FacePoint {
            point_m,
            normal: self.normal,
            in_front_m: off.dot(self.normal),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    /// A wall at x = 0.6 with a box of 0.12 m in front of it.
    fn wall_and_box() -> Barriers {
        let mut barriers = Barriers::default();
        let new = |middle: [f64; 3], normal: DVec3, half| {
            Barrier::new(DVec3::from_array(middle), normal, half).expect("a rectangle")
        };
        barriers.set(&[
            new([0.6, 0.0, 0.5], DVec3::X, [1.0, 1.0]),
            new([0.72, 0.0, 0.3], DVec3::X, [0.2, 0.1]),
            new([0.66, 0.2, 0.3], DVec3::Y, [0.06, 0.1]),
            new([0.66, -0.2, 0.3], DVec3::NEG_Y, [0.06, 0.1]),
        ]);
        barriers
    }

    fn in_front_m(barriers: &Barriers, at: [f64; 3]) -> f64 {
        let point_m = DVec3::from_array(at);
        barriers
            .nearest(point_m)
            .expect("there are some")
            .in_front_m
    }

    #[test]
    fn the_nearest_surface_decides() {
        let barriers = wall_and_box();
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} instead of {b}");
        close(in_front_m(&barriers, [0.5, 0.0, 0.7]), -0.1);
        close(in_front_m(&barriers, [0.601, 0.3, 0.3]), 0.001);
        close(in_front_m(&barriers, [0.7, 0.0, 0.3]), -0.02);
        close(in_front_m(&barriers, [0.75, 0.0, 0.3]), 0.03);
        close(in_front_m(&barriers, [0.66, 0.21, 0.3]), 0.01);
    }

    #[test]
    fn what_the_goal_covers_may_be_covered() {
        let barriers = wall_and_box();
        let board = Board::default();
        let facing_x = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
        let face = Pose::new(facing_x, DVec3::new(0.72, 0.15, 0.3)).expect("finite");
        let out = barriers
            .most_in_front(&board, &face, &[None], &[None])
            .expect("there are some");
        assert!(out.in_front_m > 0.04, "{out:?}");
        let footprint = Footprint::new(face, &board, 0.01);
        let out = barriers
            .most_in_front(&board, &face, &[Some(footprint)], &[None])
            .expect("there are some");
        assert!(out.in_front_m.abs() < 1e-12, "{out:?}");
        // But not what is before the goal.
        let before = face.at(DVec3::new(0.74, 0.15, 0.3));
        let out = barriers
            .most_in_front(&board, &before, &[Some(footprint)], &[None])
            .expect("there are some");
        assert!(out.in_front_m > 0.02 - 1e-12, "{out:?}");
    }
}
