//! Many surfaces, and which of them is nearest to a point.

use super::{
    Barrier, Beside, EDGE_M, FacePoint, FacePoints, Footprint, Plane, SAME_PLANE_M,
    corners_and_middle,
};
use crate::board::Board;
use glam::DVec3;
use hwall_geometry::Pose;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use std::cell::Cell;
use std::sync::Arc;

/// Surfaces that the board stays behind, in a bounding volume hierarchy. Clones share it.
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

    /// How far the corners or the centre of a face are in front of the surfaces, m, negative behind all of them; `None` without surfaces.
    #[must_use]
    pub fn protrusion_m(&self, board: &Board, face: &Pose) -> Option<f64> {
        let barriers = Barriers::from(self.clone());
        let point = barriers.most_in_front(board, face, &[], &[])?;
        Some(point.in_front_m)
    }
}

/// Up to this many, testing each surface is quicker than the tree.
const FEW: usize = 16;
/// Most open nodes of a walk. In practice the tree of [`PlocBuilder`] is no deeper than three times the logarithm of its leaves; a walk that runs out
/// of space tests all barriers.
const OPEN: usize = 96;

/// The surfaces, and the number of boxes and rectangles tested.
#[derive(Debug, Clone, Default)]
pub(in crate::motion) struct Barriers {
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
    /// Resets the count.
    pub(in crate::motion) fn begin(&self) {
        self.tests.set(0);
    }

    /// Boxes and rectangles tested since then.
    pub(in crate::motion) const fn tests(&self) -> usize {
        self.tests.get()
    }

    pub(in crate::motion) fn is_empty(&self) -> bool {
        self.tree.all().is_empty()
    }

    pub(in crate::motion) fn set(&mut self, tree: BarrierTree) {
        self.tree = tree;
    }

    /// Calls `show` for the barriers in boxes whose lower bound `least` is within `bound`, boxes with smaller values first. The bound may shrink
    /// meanwhile.
    pub(in crate::motion) fn walk<S>(
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
    pub(in crate::motion) fn have(&self, point_m: DVec3, normal: DVec3) -> bool {
        let mut found = false;
        self.walk(
            &mut found,
            |aabb| distance_m(aabb, point_m),
            |found| if *found { -1.0 } else { SAME_PLANE_M },
            |found, barrier| *found |= barrier.is_at(point_m, normal),
        );
        found
    }

    /// The corner or centre of the face that comes furthest in front of the surfaces, see [`all_in_front`](Self::all_in_front).
    pub(in crate::motion) fn most_in_front(
        &self,
        board: &Board,
        face: &Pose,
        footprints: &[Option<Footprint>],
        planes: &[Option<Plane>],
    ) -> Option<FacePoint> {
        let all = self.all_in_front(board, face, footprints, planes);
        all.into_iter().flatten().reduce(FacePoint::or_further)
    }

    /// Positions of the corners and the centre of the face relative to the surfaces, eased by footprints. The planes count in addition to the
    /// barriers.
    ///
    /// The surface nearest to a point decides on which side the point is, as for a closed mesh: next to a shelf the board is
    /// behind the wall, not beside the shelf.
    pub(in crate::motion) fn all_in_front(
        &self,
        board: &Board,
        face: &Pose,
        footprints: &[Option<Footprint>],
        planes: &[Option<Plane>],
    ) -> FacePoints {
        corners_and_middle(board, face).map(|point_m| self.side_of(point_m, footprints, planes))
    }

    /// The same for any point.
    pub(in crate::motion) fn side_of(
        &self,
        point_m: DVec3,
        footprints: &[Option<Footprint>],
        planes: &[Option<Plane>],
    ) -> Option<FacePoint> {
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
    }

    /// The side of the nearest surface that a point is on.
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
                    // Beyond a common edge, the surface that faces the point decides.
                    let faces = place.in_front_m.abs() > least.in_front_m.abs();
                    less_m > EDGE_M || (less_m >= -EDGE_M && faces)
                });
                if nearer {
                    *nearest = Some((place, barrier.normal()));
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

    /// Distance to the nearest surface, m; infinite without surfaces.
    pub(in crate::motion) fn least_distance_m(&self, point_m: DVec3) -> f64 {
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

/// Lower bound of the distance from a point to the contents of a box, m.
pub(in crate::motion) fn distance_m(aabb: &Aabb, point_m: DVec3) -> f64 {
    let [min, max] = [aabb.min, aabb.max].map(|corner| corner.as_dvec3());
    (min - point_m).max(point_m - max).max(DVec3::ZERO).length()
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

    #[test]
    fn the_nearest_surface_decides() {
        let barriers = wall_and_box();
        for (at, wanted_m) in [
            ([0.5, 0.0, 0.7], -0.1),
            ([0.601, 0.3, 0.3], 0.001),
            ([0.7, 0.0, 0.3], -0.02),
            ([0.75, 0.0, 0.3], 0.03),
            ([0.66, 0.21, 0.3], 0.01),
        ] {
            let found = barriers.nearest(DVec3::from_array(at));
            let in_front_m = found.expect("there are some").in_front_m;
            assert!((in_front_m - wanted_m).abs() < 1e-12, "{in_front_m}");
        }
    }

    #[test]
    fn what_the_goal_covers_may_be_covered() {
        let barriers = wall_and_box();
        let board = Board::default();
        let facing_x = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
        let face = Pose::new(facing_x, DVec3::new(0.72, 0.15, 0.3)).expect("finite");
        let in_front_m = |face: &Pose, footprint: Option<Footprint>| {
            let found = barriers.most_in_front(&board, face, &[footprint], &[None]);
            found.expect("there are some").in_front_m
        };
        assert!(in_front_m(&face, None) > 0.04);
        let footprint = Some(Footprint::new(face, &board, 0.01));
        assert!(in_front_m(&face, footprint).abs() < 1e-12);
        // But not what is in front of the goal.
        let before = face.at(DVec3::new(0.74, 0.15, 0.3));
        assert!(in_front_m(&before, footprint) > 0.02 - 1e-12);
    }
}
