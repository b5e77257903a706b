//! Planar vertical pieces of surfaces: facets.

use crate::part::closest::closest_point;
use crate::part::triangle::{self, Triangle};
use crate::surface::SurfaceId;
use glam::DVec3;
use std::collections::HashMap;

/// A face counts as vertical if its normal is within this angle of horizontal, and two faces as coplanar if their
/// normals differ by less, rad. One degree: four decimals in files tilt small faces of a wall by that much.
pub const VERTICAL_TOLERANCE_RAD: f64 = 0.0175;

/// A planar vertical piece of a touchable surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Facet {
    /// The surface it belongs to.
    pub surface: SurfaceId,
    /// The centroid, m, or the middle of the nearest face if the centroid lies in a hole.
    pub point_m: DVec3,
    /// Unit normal, outward by the winding of the file.
    pub normal: DVec3,
    /// Area of the faces, m²; less than that of the outline if the facet has holes or notches.
    pub area_m2: f64,
    /// Convex outline in the plane, m, counter-clockwise seen from outside.
    pub outline_m: Vec<DVec3>,
    /// Horizontal extent, m.
    pub width_m: f64,
    /// Lowest point along the z axis, m.
    pub lowest_m: f64,
    /// Highest point along the z axis, m.
    pub highest_m: f64,
}

/// Vertical facets of one surface.
pub(crate) fn vertical(surface: SurfaceId, triangles: &[Triangle]) -> Vec<Facet> {
    let upright: Vec<usize> = (0..triangles.len())
        .filter(|&i| triangle::normal(&triangles[i]).z.abs() <= VERTICAL_TOLERANCE_RAD.sin())
        .collect();
    let mut by_corner: HashMap<[u64; 3], Vec<usize>> = HashMap::new();
    for &i in &upright {
        for corner in triangles[i] {
            by_corner.entry(bits(corner)).or_default().push(i);
        }
    }
    // The largest face has the most accurate normal, so facets grow from it.
    let mut seeds = upright;
    seeds.sort_by(|&a, &b| {
        triangle::area_m2(&triangles[b]).total_cmp(&triangle::area_m2(&triangles[a]))
    });
    let mut taken = vec![false; triangles.len()];
    let mut facets = Vec::new();
    for seed in seeds {
        if taken[seed] {
            continue;
        }
        taken[seed] = true;
        let plane = Plane::of(&triangles[seed]);
        let mut members = vec![seed];
        let mut next = 0;
        while let Some(&member) = members.get(next) {
            next += 1;
            for neighbour in triangles[member].iter().flat_map(|&c| &by_corner[&bits(c)]) {
                if !taken[*neighbour] && plane.holds(&triangles[*neighbour]) {
                    taken[*neighbour] = true;
                    members.push(*neighbour);
                }
            }
        }
        let faces: Vec<Triangle> = members.iter().map(|&i| triangles[i]).collect();
        facets.push(facet(surface, plane.normal, &faces));
    }
    facets
}

fn bits(p: DVec3) -> [u64; 3] {
    p.to_array().map(|x| (x + 0.0).to_bits())
}

struct Plane {
    normal: DVec3,
    point_m: DVec3,
    size_m: f64,
}

impl Plane {
    fn of(seed: &Triangle) -> Self {
        let size_m = seed[0].distance(seed[1]).max(seed[1].distance(seed[2]));
        Self {
            normal: triangle::normal(seed),
            point_m: seed[0],
            size_m,
        }
    }

    /// True if the triangle faces the same way and all its corners are within the plane's
    /// tolerance: that of files with four decimals (relative to the seed, for small scenes).
    fn holds(&self, other: &Triangle) -> bool {
        let off = other
            .iter()
            .map(|&c| (c - self.point_m).dot(self.normal).abs())
            .fold(0.0, f64::max);
        let aligned = triangle::normal(other).dot(self.normal) >= VERTICAL_TOLERANCE_RAD.cos();
        aligned && off <= 1e-3 * self.size_m
    }
}

fn facet(surface: SurfaceId, normal: DVec3, faces: &[Triangle]) -> Facet {
    let area_m2: f64 = faces.iter().map(triangle::area_m2).sum();
    let moment = |t: &Triangle| (t[0] + t[1] + t[2]) / 3.0 * triangle::area_m2(t);
    let centroid = faces.iter().map(moment).sum::<DVec3>() / area_m2;
    // The centroid of a wall with a window may lie in the window: use the middle of a face instead.
    let on_face = |t: &Triangle| closest_point(centroid, t).distance_squared(centroid);
    let size_squared = area_m2 * 1e-18;
    let point_m = if faces.iter().any(|t| on_face(t) <= size_squared) {
        centroid
    } else {
        let middles = faces.iter().map(|t| (t[0] + t[1] + t[2]) / 3.0);
        let distance = |p: &DVec3| p.distance_squared(centroid);
        middles
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap_or(centroid)
    };

    let right = DVec3::Z.cross(normal).normalize();
    let up = normal.cross(right);
    let flat = |p: DVec3| ((p - centroid).dot(right), (p - centroid).dot(up));
    let corners = || faces.iter().flatten().copied();
    let outline = convex_hull(corners().map(flat).collect());
    let (lowest_m, highest_m) = extent(corners().map(|p| p.z));
    let (left_m, right_m) = extent(outline.iter().map(|p| p.0));
    Facet {
        surface,
        point_m,
        normal,
        area_m2,
        outline_m: outline
            .into_iter()
            .map(|(x, y)| centroid + right * x + up * y)
            .collect(),
        width_m: right_m - left_m,
        lowest_m,
        highest_m,
    }
}

fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| {
        (lo.min(v), hi.max(v))
    })
}

/// Andrew's monotone chain, counter-clockwise, without corners that lie on a side.
fn convex_hull(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    points.dedup();
    let size = points
        .iter()
        .fold(0.0, |m: f64, p| m.max(p.0.abs()).max(p.1.abs()));
    let chain = |points: &mut dyn Iterator<Item = (f64, f64)>| {
        let mut hull: Vec<(f64, f64)> = Vec::new();
        for p in points {
            while let [.., a, b] = hull[..] {
                if (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0) > 1e-12 * size * size {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
        hull
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}
