//! One rigid part: its triangles, their hierarchy, rays and closest points in its own frame.
//!
//! The hierarchy is single precision. Coordinates for it are taken relative to the middle of
//! the part and divided by a power of two, so they lie in [-1, 1] whatever the size and place
//! of the part.

use crate::BuildQuality;
use crate::packet::PacketRay;
use crate::tree::{BoxRay, PADDING, Tree};
use crate::triangle::{self, RayF64, Triangle};
use glam::DVec3;

/// Slack when single-precision distances are compared, in units of the part; f64 decides afterwards.
const DISTANCE_SLACK: f32 = 2.0 * PADDING;

/// Two distances this close (relative) are a tie, as they are at a shared edge.
const TIE: f64 = 1e-12;

/// Surfaces of a part that have a bit of their own in the hierarchy; the others share the rest.
const OWN_BITS: usize = 48;

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
    /// Surface of each triangle.
    surfaces: Vec<u32>,
    /// By surface: its bit in the hierarchy, zero for surfaces of other parts.
    bits: Vec<u64>,
    tree: Tree,
    unit_m: f64,
    half_extent_m: DVec3,
}

impl Part {
    /// Triangles must be finite, none degenerate, and at least one; the origin of the frame is
    /// the middle of their box, which is returned in the frame they were given in.
    pub(crate) fn build(
        mut triangles: Vec<Triangle>,
        surfaces: Vec<u32>,
        quality: BuildQuality,
    ) -> (Self, DVec3) {
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
        (
            Self::with_frame(triangles, surfaces, unit_m, half_extent_m, quality),
            middle,
        )
    }

    /// The same part with another hierarchy.
    pub(crate) fn rebuilt(&self, quality: BuildQuality) -> Self {
        Self::with_frame(
            self.triangles.clone(),
            self.surfaces.clone(),
            self.unit_m,
            self.half_extent_m,
            quality,
        )
    }

    fn with_frame(
        triangles: Vec<Triangle>,
        surfaces: Vec<u32>,
        unit_m: f64,
        half_extent_m: DVec3,
        quality: BuildQuality,
    ) -> Self {
        let bits = surface_bits(&surfaces);
        // Rounded to nearest: shared corners stay shared.
        let rounded: Vec<_> = triangles
            .iter()
            .map(|t| t.map(|p| (p / unit_m).as_vec3()))
            .collect();
        let bits_of: Vec<u64> = surfaces.iter().map(|&s| bits[s as usize]).collect();
        let (tree, order) = Tree::build(&rounded, &bits_of, quality);
        Self {
            triangles: order.iter().map(|&i| triangles[i as usize]).collect(),
            surfaces: order.iter().map(|&i| surfaces[i as usize]).collect(),
            bits,
            tree,
            unit_m,
            half_extent_m,
        }
    }

    pub(crate) fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    pub(crate) fn surface(&self, triangle: usize) -> usize {
        self.surfaces[triangle] as usize
    }

    /// What marks a surface in the hierarchy: other surfaces may have the same bit, a surface of
    /// another part has none.
    pub(crate) fn bit(&self, surface: usize) -> u64 {
        self.bits.get(surface).copied().unwrap_or(0)
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.triangles)
            + size_of_val(&*self.surfaces)
            + size_of_val(&*self.bits)
            + self.tree.bytes()
    }

    /// Nearest hit at a distance in `[0, max_m)`.
    pub(crate) fn ray_cast(
        &self,
        ray: &PartRay,
        max_m: f64,
        precision: Precision,
    ) -> Option<PartHit> {
        match precision {
            Precision::Single => self.nearest_hit::<false>(ray, max_m),
            Precision::Double => self.nearest_hit_f64(ray, max_m),
        }
    }

    /// Is there a hit at a distance in `[0, max_m)`? Stops at the first.
    pub(crate) fn any_hit(&self, ray: &PartRay, max_m: f64) -> bool {
        self.nearest_hit::<true>(ray, max_m).is_some()
    }

    /// The nearest hit, or any hit: found in single precision, computed in f64.
    fn nearest_hit<const ANY: bool>(&self, ray: &PartRay, max_m: f64) -> Option<PartHit> {
        let clipped = self.clip(ray, max_m)?;
        let (start, direction) = (clipped.start(self.unit_m), clipped.direction.as_vec3());
        let packet_ray = PacketRay::new(start, direction);
        let mut best: Option<PartHit> = None;
        self.tree
            .visit_along(&BoxRay::new(start, direction), clipped.tmax(max_m, self.unit_m), |leaf, mut tmax| {
                let packet = self.tree.packet(leaf);
                let (mut hits, distances) =
                    packet_ray.intersect(packet, -DISTANCE_SLACK, tmax);
                let first = self.tree.triangles(leaf).start;
                while hits != 0 {
                    let lane = hits.trailing_zeros() as usize & 3;
                    hits &= hits - 1;
                    // An earlier lane may have brought the limit down.
                    if distances[lane] > tmax {
                        continue;
                    }
                    let hit = self.refine(&clipped, first + lane, f64::from(distances[lane]) * self.unit_m);
                    if hit.distance_m >= 0.0
                        && hit.distance_m < best.map_or(max_m, |b| b.distance_m)
                    {
                        best = Some(hit);
                        if ANY {
                            return f32::NEG_INFINITY;
                        }
                        tmax = clipped.tmax(hit.distance_m, self.unit_m);
                    }
                }
                tmax
            });
        best
    }

    /// The same with the triangle test in f64.
    fn nearest_hit_f64(&self, ray: &PartRay, max_m: f64) -> Option<PartHit> {
        let clipped = self.clip(ray, max_m)?;
        let (start, direction) = (clipped.start(self.unit_m), clipped.direction.as_vec3());
        let double = RayF64::new(clipped.start_m, clipped.direction);
        let mut best: Option<PartHit> = None;
        self.tree
            .visit_along(&BoxRay::new(start, direction), clipped.tmax(max_m, self.unit_m), |leaf, mut tmax| {
                for i in self.tree.triangles(leaf) {
                    let Some(near_m) = double.intersect(&self.triangles[i]) else {
                        continue;
                    };
                    let hit = self.refine(&clipped, i, near_m);
                    if hit.distance_m >= 0.0
                        && hit.distance_m < best.map_or(max_m, |b| b.distance_m)
                    {
                        best = Some(hit);
                        tmax = clipped.tmax(hit.distance_m, self.unit_m);
                    }
                }
                tmax
            });
        best
    }

    /// The hit on a triangle that the ray meets about `near_m` behind its start, in f64.
    fn refine(&self, clipped: &Clipped, i: usize, near_m: f64) -> PartHit {
        let near = clipped.start_m + clipped.direction * near_m;
        let double = RayF64::new(clipped.start_m, clipped.direction);
        let point_m = double.point_on(&self.triangles[i], near);
        PartHit {
            triangle: i,
            point_m,
            distance_m: clipped.skipped_m + (point_m - clipped.start_m).dot(clipped.direction),
        }
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
        Some(Clipped {
            start_m,
            direction: ray.direction,
            skipped_m,
        })
    }

    /// Closest point to `p`, nearer than `max_m`, among the triangles of the surfaces that
    /// `accept` names; `wanted` must hold their [`bit`](Self::bit)s.
    ///
    /// Of several triangles at one distance (a shared edge) the one that faces `p` most wins.
    pub(crate) fn closest(
        &self,
        p: DVec3,
        max_m: f64,
        wanted: u64,
        accept: impl Fn(usize) -> bool,
    ) -> Option<PartHit> {
        let mut best = Nearest::new(max_m);
        let per_square_unit = 1.0 / (self.unit_m * self.unit_m);
        self.tree.visit_near(p / self.unit_m, wanted, best.bound() * per_square_unit, |leaf| {
            for i in self.tree.triangles(leaf) {
                if accept(self.surface(i)) {
                    best.offer(p, i, &self.triangles[i]);
                }
            }
            best.bound() * per_square_unit
        });
        best.hit()
    }
}

/// A bit for each surface that occurs: the largest have one of their own, the rest share.
fn surface_bits(surfaces: &[u32]) -> Vec<u64> {
    let count = surfaces.iter().max().map_or(0, |&s| s as usize + 1);
    let mut triangles = vec![0_u32; count];
    for &surface in surfaces {
        triangles[surface as usize] += 1;
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

/// A ray from where it enters the box of the part.
struct Clipped {
    start_m: DVec3,
    direction: DVec3,
    skipped_m: f64,
}

impl Clipped {
    /// In single precision, in units of the part.
    fn start(&self, unit_m: f64) -> glam::Vec3 {
        (self.start_m / unit_m).as_vec3()
    }

    /// Nothing that single precision finds beyond this distance from the start can lie within
    /// `distance_m` of the origin.
    fn tmax(&self, distance_m: f64, unit_m: f64) -> f32 {
        ((distance_m - self.skipped_m) / unit_m) as f32 + DISTANCE_SLACK
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
