//! The hierarchy of a rigid part: boxes of its triangles, tested eight at a time.
//!
//! The binary hierarchy comes from `obvhs`; here its nodes are merged into nodes of eight children,
//! so that one sequence of vector instructions tests eight boxes. All values are in units of the
//! part, with coordinates in [-1, 1], in single precision.

use super::block::LANES;
use super::even_tree;
use super::machine::{Keys, LEFT_OUT, Machine, Next, distance, key};
use super::merging::Merging;
use super::node::{BoxRay, CHILDREN, LEAF, Node, UNUSED, is_leaf, leaf_of};
use glam::{DVec3, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, leaf_collapser::collapse};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use std::ops::Range;

/// Minimum padding of every box, in units of the part.
///
/// For a ray, the roundings add up to less than 13 epsilon: of the corners (1/2 epsilon), of the
/// origin (1/2), of the inverse of the direction (1/2 over a length below 4), of a component of the
/// direction that is raised to epsilon (4), and of the box test itself (3 epsilon of a distance
/// below 2). For a point within [`NEAR`], its rounding (2 epsilon) and that of its distance to a
/// box (2 epsilon of a distance below 6) add up to less than 15.
pub(super) const PADDING: f32 = 16.0 * f32::EPSILON;

/// Largest coordinate of points for which distances to boxes are computed in single precision.
const NEAR: f64 = 2.0;

/// Maximum triangles per leaf.
const LEAF_TRIANGLES: u32 = LANES as u32;

/// Stack size for traversals of typical trees: 16 levels.
const NOMINAL_STACK: usize = 120;

/// All surfaces.
pub(crate) const ALL: u64 = u64::MAX;

/// Effort spent on building the search hierarchy. Query results do not depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum BuildQuality {
    /// For short-lived scenes.
    Fast,
    /// Default of every constructor.
    #[default]
    Balanced,
    /// For scenes that are built once and queried very often.
    Best,
}

/// Maximum number of triangles in a tree.
pub(crate) const MAX_TRIANGLES: u64 = 1 << 29;

#[derive(Clone)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// For each child of each node, the surfaces below that child, as bits that surfaces may share.
    surfaces: Vec<[u64; CHILDREN]>,
    /// Maximum stack depth of a traversal.
    stack: usize,
}

/// The triangles of the leaves of a tree.
#[derive(Default)]
pub(super) struct Leaves {
    /// Triangle indices, leaf by leaf.
    pub(super) triangles: Vec<u32>,
    /// Range of each leaf in `triangles`, one to [`LANES`] long.
    pub(super) ranges: Vec<Range<usize>>,
}

impl Tree {
    /// Builds from at least one triangle in units of the part, with the bits of their surfaces.
    /// Returns the contents of the leaves.
    pub(super) fn build(
        triangles: &[[Vec3; 3]],
        bits: &[u64],
        quality: BuildQuality,
    ) -> (Self, Leaves) {
        let bvh = build_bvh(&boxes(triangles), quality);
        let merging = Merging::new(&bvh);
        let mut leaves = Leaves::default();
        let mut tree = Self {
            nodes: vec![Node::EMPTY],
            surfaces: Vec::new(),
            stack: 0,
        };
        let mut depth = 0;
        // Index in this tree, index in the binary tree, level.
        let mut open = vec![(0_usize, 0_u32, 1)];
        while let Some((index, binary, level)) = open.pop() {
            depth = depth.max(level);
            let mut node = Node::EMPTY;
            for (lane, child) in merging
                .children_of(binary)
                .into_iter()
                .flatten()
                .enumerate()
            {
                let binary_child = &bvh.nodes[child as usize];
                let aabb = binary_child.aabb();
                for axis in 0..3 {
                    node.planes[0][axis][lane] = aabb.min[axis];
                    node.planes[1][axis][lane] = aabb.max[axis];
                }
                if binary_child.is_leaf() {
                    let start = binary_child.first_index as usize;
                    let held = &bvh.primitive_indices[start..][..binary_child.prim_count as usize];
                    debug_assert!(held.len() <= LANES, "a leaf is a block");
                    node.children[lane] = LEAF | leaves.ranges.len() as u32;
                    let first = leaves.triangles.len();
                    leaves.ranges.push(first..first + held.len());
                    leaves.triangles.extend_from_slice(held);
                } else {
                    node.children[lane] = tree.nodes.len() as u32;
                    open.push((tree.nodes.len(), child, level + 1));
                    tree.nodes.push(Node::EMPTY);
                }
            }
            tree.nodes[index] = node;
        }
        // Each level leaves at most seven children pending; the last one writes eight.
        tree.stack = (CHILDREN - 1) * depth + CHILDREN;
        tree.mark(bits, &leaves);
        (tree, leaves)
    }

    /// Collects the surfaces below each node. Children have a higher index than their parents.
    fn mark(&mut self, bits: &[u64], leaves: &Leaves) {
        self.surfaces = vec![[0; CHILDREN]; self.nodes.len()];
        for index in (0..self.nodes.len()).rev() {
            for lane in 0..CHILDREN {
                self.surfaces[index][lane] = match self.nodes[index].children[lane] {
                    UNUSED => 0,
                    leaf if is_leaf(leaf) => {
                        let held = &leaves.triangles[leaves.ranges[leaf_of(leaf)].clone()];
                        held.iter().fold(0, |all, &i| all | bits[i as usize])
                    }
                    node => self.surfaces[node as usize]
                        .iter()
                        .fold(0, |all, s| all | s),
                };
            }
        }
    }

    /// Bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.surfaces)
    }

    /// Maximum stack depth of a traversal.
    pub(super) fn stack(&self) -> usize {
        self.stack
    }

    #[inline(always)]
    pub(super) fn node(&self, node: u32) -> &Node {
        &self.nodes[node as usize]
    }

    /// The children of a node that a ray meets at a distance up to `max`.
    #[inline(always)]
    pub(super) fn open<M: Machine>(&self, machine: M, ray: &BoxRay, node: u32, max: f32) -> Next {
        let node = self.node(node);
        machine.next(machine.along(ray, node, max), &node.children)
    }

    /// Calls `leaf` with the numbers of the leaves that a ray meets at a distance up to `max`,
    /// nearest box first; it returns the new `max`.
    #[inline(always)]
    pub(super) fn visit_along<M: Machine>(
        &self,
        machine: M,
        ray: &BoxRay,
        max: f32,
        mut leaf: impl FnMut(usize, f32) -> f32,
    ) {
        self.visit(
            machine,
            max,
            #[inline(always)]
            |node, max| machine.along(ray, &self.nodes[node], max),
            #[inline(always)]
            |child, max| leaf(leaf_of(child), max),
        );
    }

    /// Calls `leaf` with the numbers of the leaves that may contain one of the `wanted` surfaces within a distance
    /// of `p`, nearest box first. `within_squared`: square of that distance; `leaf` returns its new value.
    #[inline(always)]
    pub(super) fn visit_near<M: Machine>(
        &self,
        machine: M,
        p: DVec3,
        wanted: u64,
        within_squared: f64,
        leaf: impl FnMut(usize) -> f64,
    ) {
        if p.abs().max_element() <= NEAR {
            let p = p.as_vec3().to_array();
            self.visit_within(
                machine,
                #[inline(always)]
                |node, max| machine.near(&p, node, max),
                0.0,
                wanted,
                within_squared,
                leaf,
            );
        } else {
            // Single precision cannot resolve distances of far points, so subtract the squared
            // distance to the part from their squares.
            let least = DVec3::splat(1.0 + f64::from(PADDING) * 2.0);
            let offset = p.distance_squared(p.clamp(-least, least));
            let keys = |node: &Node, max: f32| {
                let mut keys = [LEFT_OUT; CHILDREN];
                for (lane, to) in keys.iter_mut().enumerate() {
                    let plane = |side: usize| {
                        DVec3::from_array(
                            [0, 1, 2].map(|axis| f64::from(node.planes[side][axis][lane])),
                        )
                    };
                    let outside = (plane(0) - p).max(p - plane(1)).max(DVec3::ZERO);
                    let more = ((outside.length_squared() - offset) as f32)
                        .next_down()
                        .max(0.0);
                    if more <= max {
                        *to = key(more, lane);
                    }
                }
                keys
            };
            self.visit_within(machine, keys, offset, wanted, within_squared, leaf);
        }
    }

    #[inline(always)]
    fn visit_within<M: Machine>(
        &self,
        machine: M,
        near: impl Fn(&Node, f32) -> Keys,
        offset: f64,
        wanted: u64,
        within_squared: f64,
        mut leaf: impl FnMut(usize) -> f64,
    ) {
        self.visit(
            machine,
            upwards(within_squared, offset),
            #[inline(always)]
            |index, max| {
                let node = &self.nodes[index];
                let mut keys = near(node, max);
                // An unlimited search would accept even the boxes of unused lanes.
                for (key, &child) in keys.iter_mut().zip(&node.children) {
                    *key = if child == UNUSED { LEFT_OUT } else { *key };
                }
                if wanted != ALL {
                    for (key, &surfaces) in keys.iter_mut().zip(&self.surfaces[index]) {
                        *key = if surfaces & wanted == 0 {
                            LEFT_OUT
                        } else {
                            *key
                        };
                    }
                }
                keys
            },
            #[inline(always)]
            |child, _| upwards(leaf(leaf_of(child)), offset),
        );
    }

    #[inline(always)]
    fn visit<M: Machine>(
        &self,
        machine: M,
        max: f32,
        boxes: impl Fn(usize, f32) -> Keys,
        leaf: impl FnMut(u32, f32) -> f32,
    ) {
        let (mut nominal, mut deep) = ([[0; 2]; NOMINAL_STACK], Vec::new());
        // Deeper trees occur only with thousands of faces in one spot. The traversal has a single call site, so that the compiler inlines `leaf`.
        let stack = if self.stack <= NOMINAL_STACK {
            nominal.as_flattened_mut()
        } else {
            deep.resize(2 * self.stack, 0);
            &mut deep[..]
        };
        let (keys, children) = stack.split_at_mut(stack.len() / 2);
        self.visit_on(machine, keys, children, max, boxes, leaf);
    }

    /// `boxes` returns the relevant children of a node and their distances.
    ///
    /// The stack holds children and their keys.
    #[inline(always)]
    fn visit_on<M: Machine>(
        &self,
        machine: M,
        open_keys: &mut [u32],
        open: &mut [u32],
        mut max: f32,
        boxes: impl Fn(usize, f32) -> Keys,
        mut leaf: impl FnMut(u32, f32) -> f32,
    ) {
        // The root needs no distance test.
        let (mut child, mut top) = (0, 0);
        loop {
            if child & LEAF == 0 {
                let keys = boxes(child as usize, max);
                let next = machine.next(keys, &self.nodes[child as usize].children);
                // Copies all of them: a branch on their number would be mispredicted half of the time.
                open_keys[top..top + CHILDREN].copy_from_slice(&next.keys);
                open[top..top + CHILDREN].copy_from_slice(&next.children);
                if next.count != 0 {
                    child = next.nearest;
                    top += next.count - 1;
                    continue;
                }
            } else {
                max = leaf(child, max);
            }
            child = loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                if distance(open_keys[top]) <= max {
                    break open[top];
                }
            };
        }
    }
}

/// A squared distance minus an offset, in single precision, rounded up.
#[inline(always)]
fn upwards(within_squared: f64, offset: f64) -> f32 {
    let more = ((within_squared - offset) as f32).next_up();
    // The difference of two infinities: too far away to distinguish anything.
    if more.is_nan() { f32::INFINITY } else { more }
}

/// Boxes of the triangles, padded.
fn boxes(triangles: &[[Vec3; 3]]) -> Vec<Aabb> {
    triangles
        .iter()
        .enumerate()
        .map(|(i, corners)| {
            let tight = Aabb::from_points(&corners.map(Vec3A::from));
            let (low, high) = (jitter(2 * i), jitter(2 * i + 1));
            Aabb::new(tight.min - PADDING * low, tight.max + PADDING * high)
        })
        .collect()
}

/// Factor for the padding of a box: between 1 and 2 on each axis, different for each box.
///
/// The builder pairs the two boxes with the smallest union. If thousands of boxes coincide, all unions tie
/// and it merges one pair per round, so that time and tree depth explode; unequal padding breaks the ties.
fn jitter(i: usize) -> Vec3A {
    let fraction = |multiplier: u64| {
        let hash = (i as u64 + 1).wrapping_mul(multiplier);
        (hash >> 40) as f32 / (1u64 << 24) as f32
    };
    // Odd numbers near 2^64 divided by the golden ratio, sqrt 2 and sqrt 3.
    Vec3A::ONE
        + Vec3A::new(
            fraction(0x9E37_79B9_7F4A_7C15),
            fraction(0xB504_F333_F9DE_6485),
            fraction(0x93CD_3A2C_8198_E26B),
        )
}

/// The steps of the presets of `obvhs`, without the recursive self-check it adds in debug builds.
fn build_bvh(boxes: &[Aabb], quality: BuildQuality) -> Bvh2 {
    let (search, careful_levels, reinsertion_ratio) = match quality {
        BuildQuality::Fast => (PlocSearchDistance::Minimum, 0, 0.0),
        BuildQuality::Balanced => (PlocSearchDistance::Medium, 3, 0.05),
        BuildQuality::Best => (PlocSearchDistance::High, 2, 0.2),
    };
    if even_tree::is_crowded(boxes) {
        let mut bvh = even_tree::build(boxes);
        collapse(&mut bvh, LEAF_TRIANGLES, 3.0);
        return bvh;
    }
    let indices = (0..boxes.len() as u32).collect();
    let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
        search,
        boxes,
        indices,
        SortPrecision::U64,
        careful_levels,
    );
    let mut reinsertion = ReinsertionOptimizer::default();
    reinsertion.run(&mut bvh, reinsertion_ratio, None);
    // Cost of a node in triangles, high enough that leaves are filled: rays test all triangles of a leaf at once.
    collapse(&mut bvh, LEAF_TRIANGLES, 3.0);
    reinsertion.run(&mut bvh, 2.0 * reinsertion_ratio, None);
    bvh
}
