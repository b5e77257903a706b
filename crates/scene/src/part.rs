//! One rigid part: its triangles, its bounding volume hierarchy, rays and closest points in its own frame.
//!
//! The hierarchy is single precision. Coordinates for it are taken relative to the middle of
//! the part and divided by a power of two, so they lie in [-1, 1] whatever the size and place
//! of the part; every tolerance below is in those units.

use crate::triangle::{self, RayF32, RayF64, Triangle};
use glam::{DVec3, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, leaf_collapser::collapse};
use obvhs::fast_stack;
use obvhs::faststack::FastStack;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::{Ray, RayHit};

/// Growth of every box, in units of the part.
///
/// Rounding of the corners (1/2 epsilon), of the origin (1/2), of the direction (1/2 over a
/// length below 4), of a component of the direction that the box test lifts to epsilon (4) and
/// of the box test itself (3 epsilon of a distance below 2) add up to less than 13 epsilon.
const PADDING: f32 = 16.0 * f32::EPSILON;

/// Slack when single-precision distances are compared; f64 decides afterwards.
const DISTANCE_SLACK: f32 = 2.0 * PADDING;

/// Two distances this close (relative) are a tie, as they are at a shared edge.
const TIE: f64 = 1e-12;

/// Triangle test of a traversal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Precision {
    Single,
    Double,
}

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
    /// Corners in metres in the frame of the part, in the order of the leaves.
    triangles: Vec<Triangle>,
    /// The same in units of the part, rounded to nearest: shared corners stay shared.
    triangles_f32: Vec<[Vec3; 3]>,
    /// Surface of each triangle.
    surfaces: Vec<u32>,
    bvh: Bvh2,
    unit_m: f64,
    half_extent_m: DVec3,
}

impl Part {
    /// Triangles must be finite, none degenerate, and at least one; the origin of the frame is
    /// the middle of their box, which is returned in the frame they were given in.
    pub(crate) fn build(mut triangles: Vec<Triangle>, mut surfaces: Vec<u32>) -> (Self, DVec3) {
        let (min, max) = triangles
            .iter()
            .flatten()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), &p| {
                (lo.min(p), hi.max(p))
            });
        let middle = 0.5 * (min + max);
        for corner in triangles.iter_mut().flatten() {
            *corner -= middle;
        }
        let half_extent_m = (max - middle).max(middle - min);
        // A power of two: scaling is exact, so it cannot open a gap.
        let unit_m = half_extent_m.max_element().log2().ceil().exp2();

        let mut bvh = build_bvh(&boxes(&triangles, unit_m));
        let order = std::mem::take(&mut bvh.primitive_indices);
        triangles = order.iter().map(|&i| triangles[i as usize]).collect();
        surfaces = order.iter().map(|&i| surfaces[i as usize]).collect();
        let triangles_f32 = triangles
            .iter()
            .map(|t| t.map(|p| (p / unit_m).as_vec3()))
            .collect();
        (
            Self {
                triangles,
                triangles_f32,
                surfaces,
                bvh,
                unit_m,
                half_extent_m,
            },
            middle,
        )
    }

    pub(crate) fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    pub(crate) fn surface(&self, triangle: usize) -> usize {
        self.surfaces[triangle] as usize
    }

    /// Nearest hit at a distance in `[0, max_m)`.
    pub(crate) fn ray_cast(
        &self,
        ray: &PartRay,
        max_m: f64,
        precision: Precision,
    ) -> Option<PartHit> {
        let clipped = self.clip(ray, max_m)?;
        let mut best: Option<PartHit> = None;
        self.bvh
            .ray_traverse(clipped.ray, &mut RayHit::none(), |ray, i| {
                match self.test(&clipped, i, ray.tmax, precision) {
                    Some(hit) if hit.distance_m < best.map_or(max_m, |b| b.distance_m) => {
                        best = Some(hit);
                        clipped.bound(hit.distance_m, self.unit_m)
                    }
                    _ => f32::INFINITY,
                }
            });
        best
    }

    /// Is there a hit at a distance in `[0, max_m)`? Stops at the first.
    pub(crate) fn any_hit(&self, ray: &PartRay, max_m: f64) -> bool {
        let Some(clipped) = self.clip(ray, max_m) else {
            return false;
        };
        !self.bvh.ray_traverse_miss(clipped.ray, |ray, i| {
            match self.test(&clipped, i, ray.tmax, Precision::Single) {
                Some(hit) if hit.distance_m < max_m => f32::NEG_INFINITY,
                _ => f32::INFINITY,
            }
        })
    }

    /// One triangle against the ray; the hit is computed in f64 whichever test accepts it.
    #[inline(always)]
    fn test(
        &self,
        clipped: &Clipped,
        i: usize,
        tmax: f32,
        precision: Precision,
    ) -> Option<PartHit> {
        let near_m = match precision {
            Precision::Single => {
                let t = clipped.single.intersect(&self.triangles_f32[i])?;
                if !(-DISTANCE_SLACK <= t && t <= tmax + DISTANCE_SLACK) {
                    return None;
                }
                f64::from(t) * self.unit_m
            }
            Precision::Double => clipped.double.intersect(&self.triangles[i])?,
        };
        let near = clipped.start_m + clipped.direction * near_m;
        let point_m = clipped.double.point_on(&self.triangles[i], near);
        let distance_m = clipped.skipped_m + (point_m - clipped.start_m).dot(clipped.direction);
        (distance_m >= 0.0).then_some(PartHit {
            triangle: i,
            point_m,
            distance_m,
        })
    }

    /// Moves the start of the ray to just before the box of the part, in f64, so that single
    /// precision never sees a large number. `None` when the ray misses the box.
    fn clip(&self, ray: &PartRay, max_m: f64) -> Option<Clipped> {
        let slack_m = f64::from(DISTANCE_SLACK) * self.unit_m;
        let half = self.half_extent_m + DVec3::splat(slack_m);
        let (mut enter, mut leave) = (0.0_f64, max_m);
        for axis in 0..3 {
            let (o, d, h) = (ray.origin_m[axis], ray.direction[axis], half[axis]);
            if d == 0.0 {
                if o.abs() > h {
                    return None;
                }
            } else {
                let (a, b) = ((-h - o) / d, (h - o) / d);
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            }
        }
        // Far away the slab bounds are rounded by more than the slack.
        let rounding_m = 4.0 * f64::EPSILON * (ray.origin_m.abs().max_element() + enter);
        if enter > leave + rounding_m || !enter.is_finite() {
            return None;
        }
        let skipped_m = (enter - slack_m).max(0.0);
        // Where the ray enters is on the box; what leads off it is rounding of a far origin.
        let reach = half + DVec3::splat(slack_m);
        let start_m = (ray.origin_m + ray.direction * skipped_m).clamp(-reach, reach);
        let start = (start_m / self.unit_m).as_vec3();
        let direction = ray.direction.as_vec3();
        let single = RayF32::new(start, direction);
        let double = RayF64::new(start_m, ray.direction);
        let tmax = ((max_m - skipped_m) / self.unit_m) as f32 + DISTANCE_SLACK;
        let ray_f32 = Ray::new(start.into(), direction.into(), 0.0, tmax);
        Some(Clipped {
            ray: ray_f32,
            single,
            double,
            start_m,
            direction: ray.direction,
            skipped_m,
        })
    }

    /// Closest point to `p`, among the triangles of the surfaces that `accept` names, nearer than `max_m`.
    ///
    /// Of several triangles at one distance (a shared edge) the one that faces `p` most wins.
    pub(crate) fn closest(
        &self,
        p: DVec3,
        max_m: f64,
        accept: impl Fn(usize) -> bool,
    ) -> Option<PartHit> {
        let mut best = Nearest::new(max_m);
        let box_distance_squared = |node: usize| {
            let aabb = self.bvh.nodes[node].aabb();
            let (min, max) = (
                aabb.min.as_dvec3() * self.unit_m,
                aabb.max.as_dvec3() * self.unit_m,
            );
            p.distance_squared(p.clamp(min, max))
        };
        // Where the traversal stands: squared distance of the node's box, node.
        fast_stack!((f64, u32), (96, 192), self.bvh.max_depth, stack, {
            stack.push((box_distance_squared(0), 0));
            while let Some((distance_squared, index)) = stack.pop() {
                if distance_squared > best.bound() {
                    continue;
                }
                let node = &self.bvh.nodes[index as usize];
                let first = node.first_index;
                if node.is_leaf() {
                    for i in first as usize..(first + node.prim_count) as usize {
                        if accept(self.surface(i)) {
                            best.offer(p, i, &self.triangles[i]);
                        }
                    }
                } else {
                    let left = (box_distance_squared(first as usize), first);
                    let right = (box_distance_squared(first as usize + 1), first + 1);
                    let (near, far) = if left.0 <= right.0 {
                        (left, right)
                    } else {
                        (right, left)
                    };
                    stack.push(far);
                    stack.push(near);
                }
            }
        });
        best.hit()
    }

    /// Closest point to `p` among the listed triangles.
    pub(crate) fn closest_among(&self, p: DVec3, triangles: &[u32]) -> Option<PartHit> {
        let mut best = Nearest::new(f64::INFINITY);
        for &i in triangles {
            best.offer(p, i as usize, &self.triangles[i as usize]);
        }
        best.hit()
    }
}

struct Clipped {
    ray: Ray,
    single: RayF32,
    double: RayF64,
    start_m: DVec3,
    direction: DVec3,
    skipped_m: f64,
}

impl Clipped {
    /// A distance in single precision that is no smaller than `distance_m`.
    fn bound(&self, distance_m: f64, unit_m: f64) -> f32 {
        (((distance_m - self.skipped_m) / unit_m) as f32).next_up()
    }
}

/// The closest point so far.
struct Nearest {
    distance_squared: f64,
    /// How squarely the triangle faces the point: decides ties.
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

    /// Squared distance beyond which nothing matters any more.
    fn bound(&self) -> f64 {
        self.distance_squared * (1.0 + TIE)
    }

    fn offer(&mut self, p: DVec3, i: usize, triangle: &Triangle) {
        let point = triangle::closest_point(p, triangle);
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

/// Boxes of the rounded triangles, padded.
fn boxes(triangles: &[Triangle], unit_m: f64) -> Vec<Aabb> {
    triangles
        .iter()
        .enumerate()
        .map(|(i, corners)| {
            let points = corners.map(|p| (p / unit_m).as_vec3a());
            let tight = Aabb::from_points(&points);
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

/// The steps of obvhs' medium build, without the recursive self-check it adds in debug builds,
/// and with smaller leaves: the watertight test costs more than the one its leaves are sized for.
fn build_bvh(boxes: &[Aabb]) -> Bvh2 {
    let indices = (0..boxes.len() as u32).collect();
    let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        boxes,
        indices,
        SortPrecision::U64,
        3,
    );
    let mut reinsertion = ReinsertionOptimizer::default();
    reinsertion.run(&mut bvh, 0.05, None);
    collapse(&mut bvh, 4, 1.0);
    reinsertion.run(&mut bvh, 0.1, None);
    // Its traversal stack is sized by this and overwrites silently when it is too small,
    // and reinsertion may have deepened the tree.
    bvh.max_depth = depth(&bvh) + 2;
    bvh
}

fn depth(bvh: &Bvh2) -> usize {
    let mut deepest = 0;
    let mut stack = vec![(0_u32, 0_usize)];
    while let Some((index, depth)) = stack.pop() {
        deepest = deepest.max(depth);
        let node = &bvh.nodes[index as usize];
        if !node.is_leaf() {
            stack.push((node.first_index, depth + 1));
            stack.push((node.first_index + 1, depth + 1));
        }
    }
    deepest
}
