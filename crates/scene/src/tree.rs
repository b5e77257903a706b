//! The hierarchy of a rigid part: boxes four at a time, packets of triangles at the leaves.
//!
//! The binary hierarchy comes from `obvhs`; here its nodes are merged four at a time, so that
//! one sequence of vector instructions tests four boxes. Everything is in units of the part,
//! with coordinates in [-1, 1], in single precision.

use crate::packet::{LANES, Packet};
use glam::{DVec3, Vec3, Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, leaf_collapser::collapse};
use obvhs::fast_stack;
use obvhs::faststack::FastStack;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Growth of every box, in units of the part.
///
/// Rounding of the corners (1/2 epsilon), of the origin of a ray (1/2), of its direction (1/2
/// over a length below 4), of a component of the direction that is lifted to epsilon (4) and of
/// the box test itself (3 epsilon of a distance below 2) add up to less than 13 epsilon. For a
/// point within [`NEAR`], its rounding (2 epsilon) and that of its distance to a box (2 epsilon
/// of a distance below 6) add up to less than 15.
pub(crate) const PADDING: f32 = 16.0 * f32::EPSILON;

/// Coordinates of points up to which distances to boxes are computed in single precision.
const NEAR: f64 = 2.0;

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
    /// Index of a node, or `LEAF` and the index of a leaf.
    children: [u32; 4],
}

const LEAF: u32 = 1 << 31;

impl Node {
    const EMPTY: Self = Self {
        planes: [[Vec4::INFINITY; 3], [Vec4::NEG_INFINITY; 3]],
        children: [0; 4],
    };
}

#[derive(Clone)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// For each child of each node the surfaces below it, as bits that several may share.
    surfaces: Vec<[u64; 4]>,
    /// Triangles of each leaf.
    packets: Vec<Packet>,
    /// The first triangle of each leaf, and the end of the last.
    first: Vec<u32>,
    /// No traversal holds more open nodes.
    stack: usize,
}

impl Tree {
    /// Triangles in units of the part, with the bits of their surfaces; at least one. Returns
    /// the order in which the leaves hold them.
    pub(crate) fn build(
        triangles: &[[Vec3; 3]],
        bits: &[u64],
        quality: BuildQuality,
    ) -> (Self, Vec<u32>) {
        let bvh = build_bvh(&boxes(triangles), quality);
        let mut order = Vec::with_capacity(triangles.len());
        let mut tree = Self {
            nodes: vec![Node::EMPTY],
            surfaces: Vec::new(),
            packets: Vec::new(),
            first: Vec::new(),
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
                    node.children[lane] = LEAF | tree.packets.len() as u32;
                    let start = binary_child.first_index as usize;
                    let held = &bvh.primitive_indices[start..][..binary_child.prim_count as usize];
                    let corners: Vec<_> = held.iter().map(|&i| triangles[i as usize]).collect();
                    tree.packets.push(Packet::new(&corners));
                    tree.first.push(order.len() as u32);
                    order.extend_from_slice(held);
                } else {
                    node.children[lane] = tree.nodes.len() as u32;
                    open.push((tree.nodes.len(), child, level + 1));
                    tree.nodes.push(Node::EMPTY);
                }
            }
            tree.nodes[index] = node;
        }
        tree.first.push(order.len() as u32);
        // Each level leaves at most three open, the last one four.
        tree.stack = 3 * depth + 1;
        tree.mark(bits, &order);
        (tree, order)
    }

    /// Collects the surfaces below each node. Children have a higher index than their parents.
    fn mark(&mut self, bits: &[u64], order: &[u32]) {
        self.surfaces = vec![[0; 4]; self.nodes.len()];
        for index in (0..self.nodes.len()).rev() {
            for lane in 0..4 {
                self.surfaces[index][lane] = match self.nodes[index].children[lane] {
                    0 => 0,
                    leaf if leaf & LEAF != 0 => self
                        .triangles(leaf & !LEAF)
                        .fold(0, |all, i| all | bits[order[i] as usize]),
                    node => self.surfaces[node as usize].iter().fold(0, |all, s| all | s),
                };
            }
        }
    }

    /// Places of the triangles of a leaf in the order that `build` returned.
    pub(crate) fn triangles(&self, leaf: u32) -> std::ops::Range<usize> {
        self.first[leaf as usize] as usize..self.first[leaf as usize + 1] as usize
    }

    pub(crate) fn packet(&self, leaf: u32) -> &Packet {
        &self.packets[leaf as usize]
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
            + size_of_val(&*self.surfaces)
            + size_of_val(&*self.packets)
            + size_of_val(&*self.first)
    }

    /// Calls `leaf` for the leaves that a ray meets at a distance up to `max`, nearest first as
    /// far as boxes tell; it returns what `max` shall be from there on, minus infinity to stop.
    pub(crate) fn visit_along(&self, ray: &BoxRay, max: f32, mut leaf: impl FnMut(u32, f32) -> f32) {
        let mut max = max;
        fast_stack!(u64, (64, 256), self.stack, stack, {
            let mut current = 0_u32;
            loop {
                if current & LEAF != 0 {
                    max = leaf(current & !LEAF, max);
                    if max == f32::NEG_INFINITY {
                        return;
                    }
                } else {
                    let node = &self.nodes[current as usize];
                    let (hits, enter) = ray.enter(node, max);
                    if let Some(nearest) = push_far(&mut stack, hits, enter, &node.children) {
                        current = nearest;
                        continue;
                    }
                }
                current = loop {
                    let Some(entry) = stack.pop() else { return };
                    if f32::from_bits((entry >> 32) as u32) <= max {
                        break entry as u32;
                    }
                };
            }
        });
    }

    /// Calls `leaf` for the leaves that may hold one of the `wanted` surfaces within a distance
    /// of `p`, nearest first as far as boxes tell. `within_squared`: square of that distance;
    /// `leaf` returns what it shall be from there on.
    pub(crate) fn visit_near(
        &self,
        p: DVec3,
        wanted: u64,
        within_squared: f64,
        leaf: impl FnMut(u32) -> f64,
    ) {
        if p.abs().max_element() <= NEAR {
            let p = p.to_array().map(|x| Vec4::splat(x as f32));
            let squared = |node: &Node| {
                let outside = |axis: usize| {
                    let [low, high] = &node.planes;
                    (low[axis] - p[axis]).max(p[axis] - high[axis]).max(Vec4::ZERO)
                };
                let (x, y, z) = (outside(0), outside(1), outside(2));
                x * x + y * y + z * z
            };
            self.visit_near_by(squared, 0.0, wanted, within_squared, leaf);
        } else {
            // Far away all distances look alike to single precision: what is handed on is how
            // much larger their squares are than that of the distance to the part.
            let least = DVec3::splat(1.0 + f64::from(PADDING) * 2.0);
            let offset = p.distance_squared(p.clamp(-least, least));
            let squared = |node: &Node| {
                let lane = |i: usize| {
                    let plane = |side: usize| {
                        DVec3::from_array([0, 1, 2].map(|axis| f64::from(node.planes[side][axis][i])))
                    };
                    let outside = (plane(0) - p).max(p - plane(1)).max(DVec3::ZERO);
                    ((outside.length_squared() - offset) as f32).next_down().max(0.0)
                };
                Vec4::new(lane(0), lane(1), lane(2), lane(3))
            };
            self.visit_near_by(squared, offset, wanted, within_squared, leaf);
        }
    }

    fn visit_near_by(
        &self,
        squared: impl Fn(&Node) -> Vec4,
        offset: f64,
        wanted: u64,
        within_squared: f64,
        mut leaf: impl FnMut(u32) -> f64,
    ) {
        let upwards = |within_squared: f64| ((within_squared - offset) as f32).next_up();
        let mut max = upwards(within_squared);
        fast_stack!(u64, (64, 256), self.stack, stack, {
            let mut current = 0_u32;
            loop {
                if current & LEAF != 0 {
                    max = upwards(leaf(current & !LEAF));
                } else {
                    let node = &self.nodes[current as usize];
                    let distances = squared(node);
                    // Unused lanes are infinitely far, which an unlimited search accepts.
                    let mut hits = (distances.cmple(Vec4::splat(max))
                        & distances.cmplt(Vec4::INFINITY))
                    .bitmask();
                    if wanted != ALL {
                        let below = &self.surfaces[current as usize];
                        for (lane, surfaces) in below.iter().enumerate() {
                            hits &= !(u32::from(surfaces & wanted == 0) << lane);
                        }
                    }
                    if let Some(nearest) = push_far(&mut stack, hits, distances, &node.children) {
                        current = nearest;
                        continue;
                    }
                }
                current = loop {
                    let Some(entry) = stack.pop() else { return };
                    if f32::from_bits((entry >> 32) as u32) <= max {
                        break entry as u32;
                    }
                };
            }
        });
    }
}

/// Returns the nearest of the children that are `hits` and pushes the others, farthest first.
///
/// Entries are compared as whole numbers, the bits of the distance above those of the child:
/// numbers that are not negative are in the order of their bits.
#[inline(always)]
fn push_far(
    stack: &mut impl FastStack<u64>,
    mut hits: u32,
    distances: Vec4,
    children: &[u32; 4],
) -> Option<u32> {
    let distances = distances.to_array();
    let mut next = || {
        let lane = hits.trailing_zeros() as usize;
        let distance = distances.get(lane)?.to_bits();
        hits &= hits - 1;
        Some(u64::from(distance) << 32 | u64::from(children[lane]))
    };
    let mut nearest = next()?;
    let Some(second) = next() else {
        return Some(nearest as u32);
    };
    let mut far = nearest.max(second);
    nearest = nearest.min(second);
    let Some(third) = next() else {
        stack.push(far);
        return Some(nearest as u32);
    };
    let mut middle = nearest.max(third);
    nearest = nearest.min(third);
    (middle, far) = (middle.min(far), middle.max(far));
    if let Some(fourth) = next() {
        stack.push(far.max(fourth));
        far = far.min(fourth);
        (middle, far) = (middle.min(far), middle.max(far));
        (nearest, middle) = (nearest.min(middle), nearest.max(middle));
    }
    stack.push(far);
    stack.push(middle);
    Some(nearest as u32)
}

/// A ray prepared for boxes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoxRay {
    origin: [Vec4; 3],
    inverse: [Vec4; 3],
    /// By axis: which plane the ray meets first, 0 for the lower.
    entered: [usize; 3],
}

impl BoxRay {
    /// The direction must be finite.
    pub(crate) fn new(origin: Vec3, direction: Vec3) -> Self {
        // Lifted to epsilon, so that no product of zero and infinity arises.
        let lifted = direction
            .to_array()
            .map(|d| d.abs().max(f32::EPSILON).copysign(d));
        Self {
            origin: origin.to_array().map(Vec4::splat),
            inverse: lifted.map(|d| Vec4::splat(1.0 / d)),
            entered: lifted.map(|d| usize::from(d < 0.0)),
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
    let (search, precise_levels, reinsertions) = match quality {
        BuildQuality::Fast => (PlocSearchDistance::Minimum, 0, 0.0),
        BuildQuality::Balanced => (PlocSearchDistance::Medium, 3, env("RE", 0.05)),
        BuildQuality::Best => (PlocSearchDistance::High, 2, 1.0),
    };
    let indices = (0..boxes.len() as u32).collect();
    let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
        search,
        boxes,
        indices,
        SortPrecision::U64,
        precise_levels,
    );
    let mut reinsertion = ReinsertionOptimizer::default();
    reinsertion.run(&mut bvh, reinsertions, None);
    collapse(&mut bvh, LANES as u32, env("CO", 3.0));
    reinsertion.run(&mut bvh, 2.0 * reinsertions, None);
    bvh
}
fn env(name:&str, d:f32)->f32{ std::env::var(name).ok().and_then(|v|v.parse().ok()).unwrap_or(d)}
