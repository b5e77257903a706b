//! Surfaces that the board must stay behind.

use crate::board::{Board, surface_axes};
use crate::error::HapticsError;
use glam::{DVec3, Vec3A};
use hwall_geometry::{Pose, direction};
use hwall_numeric::check::{all_finite, positive};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use std::cell::Cell;
use std::sync::Arc;

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

    /// A box around it, so much larger that rounding to single precision leaves nothing out.
    fn padded_box(&self) -> Aabb {
        let [x, y] = [0, 1].map(|i| self.axes[i].abs() * self.half_extent_m[i]);
        let pad = (self.middle_m.abs() + x + y + 1.0) * f64::from(4.0 * f32::EPSILON);
        let half_m = x + y + pad;
        // What is as far away as that has no box in single precision, and no arm near it.
        let corner = |m: DVec3| Vec3A::from(m.clamp(-FAR_M, FAR_M).as_vec3());
        Aabb::new(
            corner(self.middle_m - half_m),
            corner(self.middle_m + half_m),
        )
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

/// Corners of boxes are no further away, m.
const FAR_M: DVec3 = DVec3::splat(1e30);

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

/// Surfaces that the board stays behind, in a tree of boxes. Clones share it.
#[derive(Debug, Clone, Default)]
pub struct BarrierTree(Arc<Tree>);

#[derive(Default)]
struct Tree {
    all: Vec<Barrier>,
    boxes: Bvh2,
}

impl std::fmt::Debug for Tree {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.all.fmt(f)
    }
}

impl From<Vec<Barrier>> for BarrierTree {
    fn from(all: Vec<Barrier>) -> Self {
        let boxes: Vec<Aabb> = all.iter().map(Barrier::padded_box).collect();
        let indices = (0..boxes.len() as u32).collect();
        let search = PlocSearchDistance::Minimum;
        let boxes = match boxes.is_empty() {
            true => Bvh2::default(),
            false => PlocBuilder::new().build(search, &boxes, indices, SortPrecision::U64, 0),
        };
        Self(Arc::new(Tree { all, boxes }))
    }
}

impl From<&[Barrier]> for BarrierTree {
    fn from(all: &[Barrier]) -> Self {
        all.to_vec().into()
    }
}

impl<const N: usize> From<&[Barrier; N]> for BarrierTree {
    fn from(all: &[Barrier; N]) -> Self {
        all.to_vec().into()
    }
}

impl BarrierTree {
    /// All of them, in the order in which they were given.
    #[must_use]
    pub fn all(&self) -> &[Barrier] {
        &self.0.all
    }

    /// How far corners or middle of a face are in front of the surfaces, m, negative behind all of them; `None` without any.
    #[must_use]
    pub fn protrusion_m(&self, board: &Board, face: &Pose) -> Option<f64> {
        let barriers = Barriers::from(self.clone());
        let point = barriers.most_in_front(board, face, &[], &[])?;
        Some(point.in_front_m)
    }
}

/// So few are looked at one by one sooner than by boxes.
const FEW: usize = 16;
/// Open nodes of a walk. The tree of [`PlocBuilder`] is no deeper in practice than thrice the logarithm of its leaves; a walk that
/// runs out of room looks at all barriers.
const OPEN: usize = 96;

/// The surfaces, and how many boxes and rectangles were tested.
#[derive(Debug, Clone, Default)]
pub(super) struct Barriers {
    tree: BarrierTree,
    tests: Cell<usize>,
}

impl From<BarrierTree> for Barriers {
    fn from(tree: BarrierTree) -> Self {
        Self {
            tree,
            tests: Cell::new(0),
        }
    }
}

impl Barriers {
    /// Counts anew.
    pub(super) fn begin(&self) {
        self.tests.set(0);
    }

    /// Boxes and rectangles that were tested since.
    pub(super) const fn tests(&self) -> usize {
        self.tests.get()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.tree.all().is_empty()
    }

    pub(super) fn set(&mut self, tree: BarrierTree) {
        self.tree = tree;
    }

    /// Shows the barriers in whose boxes `least`, the least value of what is looked for, is within the bound, the lesser boxes first.
    /// The bound may become narrower on the way.
    pub(super) fn walk<S>(
        &self,
        state: &mut S,
        least: impl Fn(&Aabb) -> f64,
        bound: impl Fn(&S) -> f64,
        mut show: impl FnMut(&mut S, &Barrier),
    ) {
        let Tree { all, boxes } = &*self.tree.0;
        if all.len() <= FEW {
            all.iter().for_each(|barrier| show(state, barrier));
            self.tests.set(self.tests.get() + all.len());
            return;
        }
        let value = |node: u32| least(boxes.nodes[node as usize].aabb());
        let (mut tests, mut count) = (0, 0);
        let mut open = [(0.0, 0_u32); OPEN];
        if !boxes.nodes.is_empty() {
            (open[0], count) = ((value(0), 0), 1);
        }
        while count > 0 {
            count -= 1;
            let (value_of_node, node) = open[count];
            if value_of_node > bound(state) {
                continue;
            }
            let node = &boxes.nodes[node as usize];
            let first = node.first_index;
            if node.is_leaf() {
                let held = &boxes.primitive_indices[first as usize..][..node.prim_count as usize];
                tests += held.len();
                for index in held {
                    show(state, &all[*index as usize]);
                }
            } else if count + 2 <= OPEN {
                tests += 2;
                let [left, right] = [first, first + 1].map(|node| (value(node), node));
                let (nearer, further) = match left.0 <= right.0 {
                    true => (left, right),
                    false => (right, left),
                };
                (open[count], open[count + 1]) = (further, nearer);
                count += 2;
            } else {
                tests += all.len();
                all.iter().for_each(|barrier| show(state, barrier));
                break;
            }
        }
        self.tests.set(self.tests.get() + tests);
    }

    /// Is a plane through a point one of the barriers?
    pub(super) fn have(&self, point_m: DVec3, normal: DVec3) -> bool {
        let mut found = false;
        self.walk(
            &mut found,
            |aabb| distance_m(aabb, point_m),
            |found| if *found { -1.0 } else { SAME_PLANE_M },
            |found, barrier| *found |= barrier.is_at(point_m, normal),
        );
        found
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
        self.walk(
            &mut nearest,
            |aabb| distance_m(aabb, point_m),
            |nearest| nearest.map_or(f64::INFINITY, |(least, _)| least.distance_m() + EDGE_M),
            |nearest, barrier| {
                let place = barrier.place_of(point_m);
                let nearer = nearest.is_none_or(|(least, _)| {
                    let less_m = least.distance_m() - place.distance_m();
                    // Beyond a common edge the surface that faces the point decides.
                    let faces = place.in_front_m.abs() > least.in_front_m.abs();
                    less_m > EDGE_M || (less_m >= -EDGE_M && faces)
                });
                if nearer {
                    *nearest = Some((place, barrier.normal));
                }
            },
        );
        let (place, normal) = nearest?;
        Some(FacePoint {
            point_m,
            normal,
            in_front_m: place.in_front_m,
        })
    }

    /// The distance to the nearest surface, m; infinite without any.
    pub(super) fn least_distance_m(&self, point_m: DVec3) -> f64 {
        let mut least_m = f64::INFINITY;
        self.walk(
            &mut least_m,
            |aabb| distance_m(aabb, point_m),
            |least_m| *least_m,
            |least_m, barrier| *least_m = least_m.min(barrier.place_of(point_m).distance_m()),
        );
        least_m
    }
}

/// No more than the distance of a point from what is in a box, m.
pub(super) fn distance_m(aabb: &Aabb, point_m: DVec3) -> f64 {
    let [min, max] = [aabb.min, aabb.max].map(|corner| corner.as_dvec3());
    (min - point_m).max(point_m - max).max(DVec3::ZERO).length()
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
        let new = |middle: [f64; 3], normal: DVec3, half| {
            Barrier::new(DVec3::from_array(middle), normal, half).expect("a rectangle")
        };
        let all = [
            new([0.6, 0.0, 0.5], DVec3::X, [1.0, 1.0]),
            new([0.72, 0.0, 0.3], DVec3::X, [0.2, 0.1]),
            new([0.66, 0.2, 0.3], DVec3::Y, [0.06, 0.1]),
            new([0.66, -0.2, 0.3], DVec3::NEG_Y, [0.06, 0.1]),
        ];
        Barriers::from(BarrierTree::from(&all))
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
