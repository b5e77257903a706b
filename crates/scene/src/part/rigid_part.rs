//! One rigid part: its triangles, their hierarchy, rays and closest points in its own frame.
//!
//! The hierarchy is single precision. Its coordinates are relative to the middle of the part and
//! divided by a power of two, so they lie in [-1, 1] for any size and position of the part.

use super::block::{Block, LANES};
use super::closest::closest_point;
use super::machine::{self, Machine, Task};
use super::node::BoxRay;
use super::tree::{BuildQuality, PADDING, Tree};
use super::triangle::{self, Face, Triangle};
use super::watertight::WatertightRay;
use glam::DVec3;
use std::ops::Range;

/// Slack of single-precision distances to boxes, in units of the part.
const DISTANCE_SLACK: f32 = 2.0 * PADDING;

/// Two distances this close (relative) are a tie, as at a shared edge.
const TIE: f64 = 1e-12;

/// Number of surfaces of a part with their own bit in the hierarchy; the others share the remaining bits.
const OWN_BITS: usize = 48;

/// A ray in the frame of the part: finite, unit direction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PartRay {
    pub(crate) origin_m: DVec3,
    pub(crate) direction: DVec3,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct PartHit {
    pub(crate) triangle: usize,
    pub(crate) point_m: DVec3,
    pub(crate) distance_m: f64,
}

#[derive(Clone)]
pub(crate) struct Part {
    /// One per leaf.
    pub(super) blocks: Vec<Block>,
    /// Bit of each surface in the hierarchy; zero for surfaces of other parts.
    bits: Vec<u64>,
    pub(super) tree: Tree,
    unit_m: f64,
    pub(super) per_unit: f64,
    half_extent_m: DVec3,
}

impl Part {
    /// Needs at least one face; all must be finite and not degenerate. The origin of the part frame
    /// is the middle of the faces' box; it is returned in the input frame.
    pub(crate) fn build(mut faces: Vec<Face>, quality: BuildQuality) -> (Self, DVec3) {
        let corners = faces.iter().flat_map(|f| f.corners_m);
        let (min, max) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| {
            (lo.min(p), hi.max(p))
        });
        let middle = 0.5 * (min + max);
        for corner in faces.iter_mut().flat_map(|f| &mut f.corners_m) {
            *corner -= middle;
        }
        let half_extent_m = (max - middle).max(middle - min);
        // A power of two, so that scaling is exact.
        let unit_m = half_extent_m.max_element().log2().ceil().exp2();
        (
            Self::in_frame(&faces, unit_m, half_extent_m, quality),
            middle,
        )
    }

    /// The same part with another hierarchy.
    pub(crate) fn rebuilt(&self, quality: BuildQuality) -> Self {
        let faces: Vec<Face> = self.faces().map(|(_, face)| face).collect();
        Self::in_frame(&faces, self.unit_m, self.half_extent_m, quality)
    }

    fn in_frame(faces: &[Face], unit_m: f64, half_extent_m: DVec3, quality: BuildQuality) -> Self {
        let bits = surface_bits(faces);
        let rounded: Vec<_> = faces
            .iter()
            .map(|f| f.corners_m.map(|p| (p / unit_m).as_vec3()))
            .collect();
        let bits_of: Vec<u64> = faces.iter().map(|f| bits[f.surface as usize]).collect();
        let (tree, leaves) = Tree::build(&rounded, &bits_of, quality);
        let block = |leaf: &Range<usize>| {
            let held = leaves.triangles[leaf.clone()].iter();
            Block::new(held.map(|&i| &faces[i as usize]))
        };
        Self {
            blocks: leaves.ranges.iter().map(block).collect(),
            bits,
            tree,
            unit_m,
            per_unit: 1.0 / unit_m,
            half_extent_m,
        }
    }

    /// All triangles, leaf by leaf, with their numbers: four times the leaf index plus the lane.
    pub(crate) fn faces(&self) -> impl Iterator<Item = (usize, Face)> + '_ {
        let lanes = |(leaf, block): (usize, &Block)| (0..block.len()).map(move |lane| (leaf, lane));
        let all = self.blocks.iter().enumerate().flat_map(lanes);
        all.map(|(leaf, lane)| (LANES * leaf + lane, self.blocks[leaf].face(lane)))
    }

    /// The triangle with a number.
    #[inline(always)]
    pub(crate) fn face(&self, number: usize) -> Face {
        self.blocks[number / LANES].face(number % LANES)
    }

    /// The bit of a surface in the hierarchy: other surfaces may share it; a surface of another part has none.
    pub(crate) fn bit(&self, surface: usize) -> u64 {
        self.bits.get(surface).copied().unwrap_or(0)
    }

    /// Heap size, bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.blocks) + size_of_val(&*self.bits) + self.tree.bytes()
    }

    /// Nearest hit at a distance in `[0, max_m)`.
    pub(crate) fn ray_cast(&self, ray: &PartRay, max_m: f64) -> Option<PartHit> {
        machine::run(Hit::<false> {
            part: self,
            ray,
            max_m,
        })
    }

    /// True if there is a hit at a distance in `[0, max_m)`. Stops at the first.
    pub(crate) fn any_hit(&self, ray: &PartRay, max_m: f64) -> bool {
        machine::run(Hit::<true> {
            part: self,
            ray,
            max_m,
        })
        .is_some()
    }

    /// The nearest hit, or any hit.
    #[inline(always)]
    fn hit<const ANY: bool, M: Machine>(
        &self,
        machine: M,
        ray: &PartRay,
        max_m: f64,
    ) -> Option<PartHit> {
        let clipped = self.clip(ray, max_m)?;
        let boxes = BoxRay::new(clipped.start_m * self.per_unit, clipped.inverse);
        let exact = WatertightRay::new(clipped.start_m, ray.direction, clipped.inverse);
        let mut best_m = max_m - clipped.skipped_m;
        let mut best = None;
        self.tree.visit_along(
            machine,
            &boxes,
            self.bound(best_m),
            #[inline(always)]
            |leaf, max| {
                let block = self.blocks.get(leaf);
                let least_m = -clipped.skipped_m;
                let met = block.and_then(
                    #[inline(always)]
                    |block| exact.intersect_block(machine.simd(), block, least_m, best_m),
                );
                match met {
                    Some((lane, distance_m)) => {
                        best_m = distance_m;
                        best = Some(LANES * leaf + lane);
                        if ANY {
                            f32::NEG_INFINITY
                        } else {
                            self.bound(best_m)
                        }
                    }
                    None => max,
                }
            },
        );
        let triangle = best?;
        let point_m = exact.point_on(&self.face(triangle).corners_m);
        Some(PartHit {
            triangle,
            point_m,
            distance_m: clipped.skipped_m + best_m,
        })
    }

    /// Largest box distance relevant for hits nearer than this.
    #[inline(always)]
    pub(super) fn bound(&self, distance_m: f64) -> f32 {
        (distance_m * self.per_unit) as f32 + DISTANCE_SLACK
    }

    /// Moves the start of the ray to just before the box of the part, in f64, so that large numbers
    /// never reach the single-precision code. `None` if the ray misses the box.
    pub(super) fn clip(&self, ray: &PartRay, max_m: f64) -> Option<Clipped> {
        let slack_m = f64::from(DISTANCE_SLACK) * self.unit_m;
        let half = self.half_extent_m + DVec3::splat(slack_m);
        let inverse = ray.direction.recip();
        let (mut enter, mut leave) = (0.0_f64, max_m);
        let (to_low, to_high) = (-half - ray.origin_m, half - ray.origin_m);
        for axis in 0..3 {
            // For a ray parallel to the slab these are infinite, with the same sign if the ray is
            // outside. NaN (exactly on the border) has no effect.
            let (a, b) = (to_low[axis] * inverse[axis], to_high[axis] * inverse[axis]);
            let (first, last) = if a < b { (a, b) } else { (b, a) };
            enter = if first > enter { first } else { enter };
            leave = if last < leave { last } else { leave };
        }
        // For distant origins the rounding of the slab bounds exceeds the slack.
        let rounding_m = 4.0 * f64::EPSILON * (ray.origin_m.abs().max_element() + enter);
        if enter > leave + rounding_m || !enter.is_finite() {
            return None;
        }
        let skipped_m = (enter - slack_m).max(0.0);
        // The entry point is on the box; any deviation is rounding from a distant origin.
        let reach = half + DVec3::splat(slack_m);
        let start_m = (ray.origin_m + ray.direction * skipped_m).clamp(-reach, reach);
        Some(Clipped {
            start_m,
            inverse,
            skipped_m,
        })
    }

    /// Closest point to `p`, nearer than `max_m`, among the triangles of the surfaces accepted by
    /// `accept`; `wanted` must contain their [`bit`](Self::bit)s.
    ///
    /// Of several triangles at the same distance (a shared edge) the one that faces `p` most directly wins.
    pub(crate) fn closest(
        &self,
        p: DVec3,
        max_m: f64,
        wanted: u64,
        accept: impl Fn(usize) -> bool,
    ) -> Option<PartHit> {
        machine::run(Closest {
            part: self,
            p,
            max_m,
            wanted,
            accept,
        })
    }
}

/// The nearest hit of a ray, or any hit.
struct Hit<'a, const ANY: bool> {
    part: &'a Part,
    ray: &'a PartRay,
    max_m: f64,
}

impl<const ANY: bool> Task for Hit<'_, ANY> {
    type Output = Option<PartHit>;

    #[inline(always)]
    fn run<M: Machine>(self, machine: M) -> Self::Output {
        self.part.hit::<ANY, M>(machine, self.ray, self.max_m)
    }
}

/// The closest point among accepted surfaces.
struct Closest<'a, F> {
    part: &'a Part,
    p: DVec3,
    max_m: f64,
    wanted: u64,
    accept: F,
}

impl<F: Fn(usize) -> bool> Task for Closest<'_, F> {
    type Output = Option<PartHit>;

    #[inline(always)]
    fn run<M: Machine>(self, machine: M) -> Self::Output {
        let Self { part, p, .. } = self;
        let mut best = Nearest::new(self.max_m);
        let per_square_unit = part.per_unit * part.per_unit;
        part.tree.visit_near(
            machine,
            p * part.per_unit,
            self.wanted,
            best.bound() * per_square_unit,
            |leaf| {
                let block = &part.blocks[leaf];
                for lane in 0..block.len() {
                    let face = block.face(lane);
                    if (self.accept)(face.surface as usize) {
                        best.offer(p, LANES * leaf + lane, &face.corners_m);
                    }
                }
                best.bound() * per_square_unit
            },
        );
        best.hit()
    }
}

/// A bit for each surface that occurs: the largest surfaces have their own, the others share the rest.
fn surface_bits(faces: &[Face]) -> Vec<u64> {
    let count = faces.iter().map(|f| f.surface as usize + 1).max();
    let count = count.unwrap_or(0);
    let mut triangles = vec![0_u32; count];
    for face in faces {
        triangles[face.surface as usize] += 1;
    }
    let mut by_size: Vec<usize> = (0..count).filter(|&s| triangles[s] > 0).collect();
    by_size.sort_by_key(|&s| std::cmp::Reverse(triangles[s]));
    let mut bits = vec![0; count];
    for (rank, surface) in by_size.into_iter().enumerate() {
        let place = if rank < OWN_BITS {
            rank
        } else {
            OWN_BITS + rank % (64 - OWN_BITS)
        };
        bits[surface] = 1 << place;
    }
    bits
}

/// A ray starting where it enters the box of the part.
pub(super) struct Clipped {
    pub(super) start_m: DVec3,
    /// Reciprocal of each component of the direction.
    pub(super) inverse: DVec3,
    pub(super) skipped_m: f64,
}

/// The closest point so far.
struct Nearest {
    distance_squared: f64,
    /// How directly the triangle faces the point: breaks ties.
    facing: f64,
    found: Option<(usize, DVec3)>,
}

impl Nearest {
    fn new(max_m: f64) -> Self {
        Self {
            distance_squared: max_m * max_m,
            facing: -1.0,
            found: None,
        }
    }

    /// Squared distance beyond which nothing is relevant.
    fn bound(&self) -> f64 {
        self.distance_squared * (1.0 + TIE)
    }

    fn offer(&mut self, p: DVec3, i: usize, triangle: &Triangle) {
        let point = closest_point(p, triangle);
        let distance_squared = p.distance_squared(point);
        if distance_squared > self.bound() {
            return;
        }
        let facing = (p - point).dot(triangle::normal(triangle)).abs();
        let tie = self.found.is_some() && distance_squared >= self.distance_squared * (1.0 - TIE);
        if !tie || facing > self.facing {
            *self = Self {
                distance_squared,
                facing,
                found: Some((i, point)),
            };
        }
    }

    fn hit(&self) -> Option<PartHit> {
        let (triangle, point_m) = self.found?;
        Some(PartHit {
            triangle,
            point_m,
            distance_m: self.distance_squared.sqrt(),
        })
    }
}

#[cfg(test)]
mod tests;
