//! The hierarchy of a rigid part: boxes of its triangles, tested four at a time.
//!
//! The binary hierarchy comes from `obvhs`; here its nodes are merged four at a time, so that
//! one sequence of vector instructions tests four boxes. Everything is in units of the part,
//! with coordinates in [-1, 1], in single precision.

use super::even_tree;
use glam::{DVec3, Vec3, Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, leaf_collapser::collapse};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use std::ops::Range;

/// Least growth of every box, in units of the part.
///
/// Rounding of the corners (1/2 epsilon), of the origin of a ray (1/2), of the inverse of its
/// direction (1/2 over a length below 4), of a component of the direction that is lifted to
/// epsilon (4) and of the box test itself (3 epsilon of a distance below 2) add up to less than
/// 13 epsilon. For a point within [`NEAR`], its rounding (2 epsilon) and that of its distance to
/// a box (2 epsilon of a distance below 6) add up to less than 15.
pub(super) const PADDING: f32 = 16.0 * f32::EPSILON;

/// Coordinates of points up to which distances to boxes are computed in single precision.
const NEAR: f64 = 2.0;

/// Triangles of a leaf at most.
const LEAF_TRIANGLES: u32 = 4;

/// Size of the stack for traversals of usual trees: about 28 levels.
const USUAL_STACK: usize = 88;

/// All surfaces.
pub(crate) const ALL: u64 = u64::MAX;

/// How much work goes into the hierarchy that queries search. Answers do not depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum BuildQuality {
    /// For scenes that live shorter than it takes to build them well.
    Fast,
    /// What every constructor uses.
    #[default]
    Balanced,
    /// For scenes that are built once and queried all day.
    Best,
}

/// Four children; unused ones have a box that nothing meets.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Node {
    /// Lower and upper planes of the boxes, by axis.
    planes: [[Vec4; 3]; 2],
    /// Index of a node, or a leaf.
    children: [u32; 4],
}

/// Marks a leaf; below it one less than the number of its triangles, below that the first.
const LEAF: u32 = 1 << 31;
const COUNT_SHIFT: u32 = 29;

/// No node has the root for a child.
const UNUSED: u32 = 0;

/// Triangles that a tree can count.
pub(crate) const MAX_TRIANGLES: u64 = 1 << COUNT_SHIFT;

fn leaf(triangles: Range<usize>) -> u32 {
    LEAF | ((triangles.len() - 1) as u32) << COUNT_SHIFT | triangles.start as u32
}

fn triangles_of(leaf: u32) -> Range<usize> {
    let first = (leaf & ((1 << COUNT_SHIFT) - 1)) as usize;
    first..first + ((leaf & !LEAF) >> COUNT_SHIFT) as usize + 1
}

impl Node {
    const EMPTY: Self = Self {
        planes: [[Vec4::INFINITY; 3], [Vec4::NEG_INFINITY; 3]],
        children: [UNUSED; 4],
    };
}

#[derive(Clone)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// For each child of each node the surfaces below it, as bits that several may share.
    surfaces: Vec<[u64; 4]>,
    /// No traversal holds more open nodes.
    stack: usize,
}

impl Tree {
    /// Triangles in units of the part, with the bits of their surfaces; at least one. Returns
    /// the order in which the leaves hold them.
    pub(super) fn build(
        triangles: &[[Vec3; 3]],
        bits: &[u64],
        quality: BuildQuality,
    ) -> (Self, Vec<u32>) {
        let bvh = build_bvh(&boxes(triangles), quality);
        let mut order = Vec::with_capacity(triangles.len());
        let mut tree = Self {
            nodes: vec![Node::EMPTY],
            surfaces: Vec::new(),
            stack: 0,
        };
        let mut depth = 0;
        // Node here, node there, level.
        let mut open = vec![(0_usize, 0_u32, 1)];
        while let Some((index, binary, level)) = open.pop() {
            depth = depth.max(level);
            let mut node = Node::EMPTY;
            for (lane, child) in four_below(&bvh, binary).into_iter().flatten().enumerate() {
                let binary_child = &bvh.nodes[child as usize];
                let aabb = binary_child.aabb();
                for axis in 0..3 {
                    node.planes[0][axis][lane] = aabb.min[axis];
                    node.planes[1][axis][lane] = aabb.max[axis];
                }
                if binary_child.is_leaf() {
                    let start = binary_child.first_index as usize;
                    let held = &bvh.primitive_indices[start..][..binary_child.prim_count as usize];
                    node.children[lane] = leaf(order.len()..order.len() + held.len());
                    order.extend_from_slice(held);
                } else {
                    node.children[lane] = tree.nodes.len() as u32;
                    open.push((tree.nodes.len(), child, level + 1));
                    tree.nodes.push(Node::EMPTY);
                }
            }
            tree.nodes[index] = node;
        }
        // Each level leaves at most three open; the last one writes four.
        tree.stack = 3 * depth + 4;
        tree.mark(bits, &order);
        (tree, order)
    }

    /// Collects the surfaces below each node. Children have a higher index than their parents.
    fn mark(&mut self, bits: &[u64], order: &[u32]) {
        self.surfaces = vec![[0; 4]; self.nodes.len()];
        for index in (0..self.nodes.len()).rev() {
            for lane in 0..4 {
                self.surfaces[index][lane] = match self.nodes[index].children[lane] {
                    UNUSED => 0,
                    leaf if leaf & LEAF != 0 => {
                        triangles_of(leaf).fold(0, |all, i| all | bits[order[i] as usize])
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

    /// Calls `leaf` with the triangles of the leaves that a ray meets at a distance up to `max`,
    /// nearest first as far as boxes tell; it returns what `max` shall be from there on.
    pub(super) fn visit_along(
        &self,
        ray: &BoxRay,
        max: f32,
        leaf: impl FnMut(Range<usize>, f32) -> f32,
    ) {
        let boxes = |node: usize, max: f32| ray.enter(&self.nodes[node], max);
        self.visit(max, boxes, leaf);
    }

    /// Calls `leaf` for the leaves that may hold one of the `wanted` surfaces within a distance
    /// of `p`, nearest first as far as boxes tell. `within_squared`: square of that distance;
    /// `leaf` returns what it shall be from there on.
    pub(super) fn visit_near(
        &self,
        p: DVec3,
        wanted: u64,
        within_squared: f64,
        leaf: impl FnMut(Range<usize>) -> f64,
    ) {
        if p.abs().max_element() <= NEAR {
            let p = p.to_array().map(|x| Vec4::splat(x as f32));
            let squared = |node: &Node| {
                let outside = |axis: usize| {
                    let [low, high] = &node.planes;
                    (low[axis] - p[axis])
                        .max(p[axis] - high[axis])
                        .max(Vec4::ZERO)
                };
                let (x, y, z) = (outside(0), outside(1), outside(2));
                x * x + y * y + z * z
            };
            self.visit_within(squared, 0.0, wanted, within_squared, leaf);
        } else {
            // Far away all distances look alike to single precision: what is handed on is how
            // much larger their squares are than that of the distance to the part.
            let least = DVec3::splat(1.0 + f64::from(PADDING) * 2.0);
            let offset = p.distance_squared(p.clamp(-least, least));
            let squared = |node: &Node| {
                let lane = |i: usize| {
                    let plane = |side: usize| {
                        DVec3::from_array(
                            [0, 1, 2].map(|axis| f64::from(node.planes[side][axis][i])),
                        )
                    };
                    let outside = (plane(0) - p).max(p - plane(1)).max(DVec3::ZERO);
                    ((outside.length_squared() - offset) as f32)
                        .next_down()
                        .max(0.0)
                };
                Vec4::new(lane(0), lane(1), lane(2), lane(3))
            };
            self.visit_within(squared, offset, wanted, within_squared, leaf);
        }
    }

    fn visit_within(
        &self,
        squared: impl Fn(&Node) -> Vec4,
        offset: f64,
        wanted: u64,
        within_squared: f64,
        mut leaf: impl FnMut(Range<usize>) -> f64,
    ) {
        let upwards = |within_squared: f64| {
            let more = ((within_squared - offset) as f32).next_up();
            // The difference of two infinities: so far away that nothing can be told apart.
            if more.is_nan() { f32::INFINITY } else { more }
        };
        let boxes = |node: usize, max: f32| {
            let distances = squared(&self.nodes[node]);
            let mut hits = distances.cmple(Vec4::splat(max)).bitmask();
            // An unlimited search accepts even the boxes of unused lanes.
            for (lane, &child) in self.nodes[node].children.iter().enumerate() {
                hits &= !(u32::from(child == UNUSED) << lane);
            }
            if wanted != ALL {
                for (lane, surfaces) in self.surfaces[node].iter().enumerate() {
                    hits &= !(u32::from(surfaces & wanted == 0) << lane);
                }
            }
            (hits, distances)
        };
        self.visit(upwards(within_squared), boxes, |triangles, _| {
            upwards(leaf(triangles))
        });
    }

    fn visit(
        &self,
        max: f32,
        boxes: impl Fn(usize, f32) -> (u32, Vec4),
        leaf: impl FnMut(Range<usize>, f32) -> f32,
    ) {
        let (mut usual, mut deep) = ([0; USUAL_STACK], Vec::new());
        // Deeper trees come from thousands of faces in one place only. The traversal is called from one place, so that
        // the compiler merges `leaf` into it.
        let stack = if self.stack <= USUAL_STACK {
            &mut usual[..]
        } else {
            deep.resize(self.stack, 0);
            &mut deep[..]
        };
        self.visit_on(stack, max, boxes, leaf);
    }

    /// `boxes` tells which children of a node matter, bit by bit, and how far they are.
    ///
    /// An entry of the stack is a child below the bits of its distance: distances are not
    /// negative, so entries are in order as whole numbers, and none is zero: no child is the root.
    #[inline(always)]
    fn visit_on(
        &self,
        stack: &mut [u64],
        mut max: f32,
        boxes: impl Fn(usize, f32) -> (u32, Vec4),
        mut leaf: impl FnMut(Range<usize>, f32) -> f32,
    ) {
        // The root has no distance yet.
        let (mut child, mut top) = (0, 0);
        loop {
            if child & LEAF == 0 {
                let (hits, distances) = boxes(child as usize, max);
                let distances = distances.to_array();
                let children = &self.nodes[child as usize].children;
                let entry = |lane: usize| {
                    let entry =
                        u64::from(distances[lane].to_bits()) << 32 | u64::from(children[lane]);
                    if hits >> lane & 1 == 1 { entry } else { 0 }
                };
                let entries = [entry(0), entry(1), entry(2), entry(3)];
                // Always four: a branch on their number would be mispredicted half of the time.
                stack[top..top + 4].copy_from_slice(&descending(entries));
                if hits != 0 {
                    // The nearest is not fetched from the stack, so that the next node waits neither for that nor for
                    // the order of the others. What is zero becomes the largest number.
                    let [a, b, c, d] = entries.map(|entry| entry.wrapping_sub(1));
                    child = a.min(b).min(c.min(d)).wrapping_add(1) as u32;
                    top += hits.count_ones() as usize - 1;
                    continue;
                }
            } else {
                max = leaf(triangles_of(child), max);
            }
            child = loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                let entry = stack[top];
                if f32::from_bits((entry >> 32) as u32) <= max {
                    break entry as u32;
                }
            };
        }
    }
}

/// A sorting network.
#[inline(always)]
fn descending([a, b, c, d]: [u64; 4]) -> [u64; 4] {
    let (a, b) = (a.max(b), a.min(b));
    let (c, d) = (c.max(d), c.min(d));
    let (a, c) = (a.max(c), a.min(c));
    let (b, d) = (b.max(d), b.min(d));
    [a, b.max(c), b.min(c), d]
}

/// A ray prepared for boxes.
#[derive(Debug, Clone, Copy)]
pub(super) struct BoxRay {
    origin: [Vec4; 3],
    inverse: [Vec4; 3],
    /// By axis: which plane the ray meets first, 0 for the lower.
    entered: [usize; 3],
}

impl BoxRay {
    /// `inverse`: of each component of the direction.
    pub(super) fn new(origin: DVec3, inverse: DVec3) -> Self {
        // The inverse of epsilon at most, so that no product of zero and infinity arises.
        let limit = f64::from(1.0 / f32::EPSILON);
        let inverse = inverse.clamp(DVec3::splat(-limit), DVec3::splat(limit));
        Self {
            origin: origin.as_vec3().to_array().map(Vec4::splat),
            inverse: inverse.as_vec3().to_array().map(Vec4::splat),
            entered: inverse.to_array().map(|d| usize::from(d < 0.0)),
        }
    }

    /// Which boxes the ray meets at a distance in `[0, max]`, bit by bit, and where it enters them.
    #[inline(always)]
    fn enter(&self, node: &Node, max: f32) -> (u32, Vec4) {
        let at = |axis: usize, side: usize| {
            (node.planes[side & 1][axis] - self.origin[axis]) * self.inverse[axis]
        };
        let [x, y, z] = self.entered;
        let enter = at(0, x).max(at(1, y)).max(at(2, z).max(Vec4::ZERO));
        let leave = at(0, 1 - x)
            .min(at(1, 1 - y))
            .min(at(2, 1 - z).min(Vec4::splat(max)));
        (enter.cmple(leave).bitmask(), enter)
    }
}

/// The up to four nodes that stand for a binary one: it is opened, then the largest below it,
/// until there are four or only leaves. A root without children stands for itself.
fn four_below(bvh: &Bvh2, binary: u32) -> [Option<u32>; 4] {
    let root = &bvh.nodes[binary as usize];
    let mut found = [None; 4];
    if root.is_leaf() {
        found[0] = Some(binary);
        return found;
    }
    found[0] = Some(root.first_index);
    found[1] = Some(root.first_index + 1);
    for free in 2..4 {
        let area = |lane: &usize| {
            let node = &bvh.nodes[found[*lane]? as usize];
            (!node.is_leaf()).then(|| node.aabb().half_area())
        };
        let largest = (0..free)
            .filter(|lane| area(lane).is_some())
            .max_by(|a, b| area(a).unwrap_or(0.0).total_cmp(&area(b).unwrap_or(0.0)));
        let Some(lane) = largest else { break };
        let first = bvh.nodes[found[lane].unwrap_or(0) as usize].first_index;
        found[lane] = Some(first);
        found[free] = Some(first + 1);
    }
    found
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

/// Between 1 and 2 on each axis, different for each box.
///
/// The builder pairs the two boxes of the smallest union. Where thousands of boxes coincide
/// all unions tie, it pairs one couple a round, and both its time and the depth of the tree
/// grow out of bounds; unequal padding breaks the ties.
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
    // A box costs as much as three triangles: four boxes are tested at once, triangles one by one
    // but without the wait for the next node.
    collapse(&mut bvh, LEAF_TRIANGLES, 3.0);
    reinsertion.run(&mut bvh, 2.0 * reinsertion_ratio, None);
    bvh
}
