//! One bump as triangles, within a given chord error.

use crate::error::{Result, TextonError};
use crate::geometry::{Texton, TextonShape};
use crate::mesh::{ChordSide, Tessellation, inside, outline as sides};
use glam::{DVec3, dvec3};
use hwall_numeric::ArgumentError;
use std::f64::consts::TAU;

/// A bump on the plane z = 0 around its middle, mm.
#[derive(Debug, Clone)]
pub(super) struct BumpMesh {
    /// The outline on the plate first, counter-clockwise.
    pub(super) points: Vec<DVec3>,
    /// How many of the points are the outline.
    pub(super) outline: usize,
    /// Counter-clockwise from outside.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Least number of points around a bump or hole at any accuracy: fewer would feel like a polygon.
pub(super) const FEWEST_AROUND: usize = 8;

impl BumpMesh {
    pub(super) fn new(texton: &Texton, ask: &Tessellation) -> Result<Self> {
        match texton.shape() {
            TextonShape::Hemiellipsoid => hemiellipsoid(texton, ask),
            TextonShape::TruncatedCone { .. } => cone(texton, ask),
        }
    }
}

/// Table size of a hemiellipsoid's metric: meridians, and steps on each.
const MERIDIANS: usize = 128;
const STEPS: usize = 128;

/// An ellipsoid as the unit sphere stretched by its radii.
///
/// A plane with unit normal n at distance d from the middle of the unit sphere becomes a plane
/// `(1 - d) s(n)` below the parallel tangent plane, with `s(n) = 1 / |n / radii|`. The chord
/// error is therefore the same in all directions along the sphere: the best mesh has round triangles of
/// circumradius `√(2 ε / s)`, evenly spread at a density that follows `s`.
struct Stretch(DVec3);

impl Stretch {
    fn scale(&self, n: DVec3) -> f64 {
        1.0 / (n / self.0).length()
    }

    /// Bound of the chord error of a triangle given on the unit sphere (or just above it).
    fn chord_error(&self, corners: [DVec3; 3]) -> f64 {
        let n = cross(corners);
        let n = n / n.length();
        (1.0 - n.dot(corners[0])) * self.scale(n)
    }
}

/// The length of each meridian from the plate upwards, in the metric `√s`.
struct Meridians {
    /// Elevations, rad, closer together where a flat bump bends.
    elevations: Vec<f64>,
    /// Length from the plate, in the metric, one row per meridian.
    way: Vec<Vec<f64>>,
}

impl Meridians {
    fn new(stretch: &Stretch) -> Self {
        let DVec3 { x: a, y: b, z: h } = stretch.0;
        let flat = h / (a * b).sqrt();
        let elevations: Vec<f64> = (0..=STEPS)
            .map(|k| {
                let even = 0.25 * TAU * k as f64 / STEPS as f64;
                (flat * even.sin()).atan2(even.cos())
            })
            .collect();
        let way = (0..MERIDIANS).map(|m| {
            let azimuth = TAU * m as f64 / MERIDIANS as f64;
            let density = |elevation: f64| stretch.scale(direction(azimuth, elevation)).sqrt();
            let mut total = 0.0;
            let steps = elevations.windows(2).map(|e| {
                total += (e[1] - e[0]) * density(0.5 * (e[0] + e[1]));
                total
            });
            std::iter::once(0.0).chain(steps).collect()
        });
        let way = way.collect();
        Self { elevations, way }
    }

    fn longest(&self) -> f64 {
        self.way.iter().map(|w| w[STEPS]).fold(0.0, f64::max)
    }

    /// Elevation at a fraction of each meridian's length.
    fn ring(&self, share: f64) -> Vec<f64> {
        let elevation = |way: &Vec<f64>| {
            let wanted = share * way[STEPS];
            let k = way.partition_point(|w| *w <= wanted).clamp(1, STEPS);
            let t = (wanted - way[k - 1]) / (way[k] - way[k - 1]);
            self.elevations[k - 1] + t * (self.elevations[k] - self.elevations[k - 1])
        };
        self.way.iter().map(elevation).collect()
    }
}

fn direction(azimuth: f64, elevation: f64) -> DVec3 {
    let (sin, cos) = elevation.sin_cos();
    let (y, x) = azimuth.sin_cos();
    dvec3(cos * x, cos * y, sin)
}

/// Points around a ring of elevations, evenly spaced in the metric.
struct Ring {
    /// Length around up to each meridian, in the metric; one more entry for the full turn.
    way: Vec<f64>,
    elevations: Vec<f64>,
}

impl Ring {
    fn new(stretch: &Stretch, elevations: Vec<f64>) -> Self {
        let n = elevations.len();
        let at = |m: usize| direction(TAU * m as f64 / n as f64, elevations[m % n]);
        let mut total = 0.0;
        let steps = (0..n).map(|m| {
            let (p, q) = (at(m), at(m + 1));
            total += q.distance(p) * stretch.scale(0.5 * (p + q)).sqrt();
            total
        });
        let way = std::iter::once(0.0).chain(steps).collect();
        Self { way, elevations }
    }

    fn length(&self) -> f64 {
        self.way[self.elevations.len()]
    }

    fn points(&self, count: usize, phase: f64) -> impl Iterator<Item = DVec3> {
        let n = self.elevations.len();
        (0..count).map(move |i| {
            let wanted = self.length() * (i as f64 + phase) / count as f64;
            let m = self.way.partition_point(|w| *w <= wanted).clamp(1, n);
            let t = (wanted - self.way[m - 1]) / (self.way[m] - self.way[m - 1]);
            let (low, high) = (self.elevations[m - 1], self.elevations[m % n]);
            let azimuth = TAU * ((m - 1) as f64 + t) / n as f64;
            direction(azimuth, low + t * (high - low))
        })
    }
}

fn hemiellipsoid(texton: &Texton, ask: &Tessellation) -> Result<BumpMesh> {
    let [a, b] = texton.radii().to_array();
    let stretch = Stretch(dvec3(a, b, texton.height_mm()));
    // With corners outside by the accuracy, chords may sag twice as deep.
    let (sag_mm, out_mm) = match ask.side {
        ChordSide::Inside => (ask.accuracy_mm, 0.0),
        ChordSide::Both => (2.0 * ask.accuracy_mm, ask.accuracy_mm),
    };
    let meridians = Meridians::new(&stretch);
    let radius = (2.0 * sag_mm).sqrt();
    // Rows of triangles with equal sides are 1.5 circumradii apart, their points √3.
    let fewest = ((meridians.longest() / (1.5 * radius)).ceil() as usize).max(1);
    let estimate = (fewest as u64).saturating_mul(fewest as u64);
    if estimate > ask.max_triangles {
        return Err(TextonError::TooManyTriangles {
            triangles: estimate,
            limit: ask.max_triangles,
        });
    }
    let mut best: Option<BumpMesh> = None;
    // Rounding up to whole rows allows wider spacing along them.
    for more in 0..12 {
        if best.is_some() && more > 2 {
            break;
        }
        let rows = fewest + more;
        let row = meridians.longest() / rows as f64;
        let widest = 2.0 * (radius * radius - (row - radius).max(0.0).powi(2)).sqrt();
        let rings: Vec<Ring> = (0..rows)
            .map(|row| Ring::new(&stretch, meridians.ring(row as f64 / rows as f64)))
            .collect();
        for shrink in 0..80 {
            let spacing = widest * 0.98_f64.powi(shrink);
            let (points, outline) = place(&rings, spacing);
            let fewest = best.as_ref().map_or(usize::MAX, |b| b.triangles.len());
            if 2 * points.len() - outline - 2 >= fewest {
                break;
            }
            let (bump, error_mm) = connect(&stretch, points, outline, out_mm)?;
            if error_mm <= ask.accuracy_mm {
                best = Some(bump);
                break;
            }
        }
    }
    let unreachable = ArgumentError::OutOfRange {
        what: "accuracy_mm",
        value: ask.accuracy_mm,
        wanted: "one that the shape of the bump allows",
    };
    best.ok_or_else(|| unreachable.into())
}

/// Points on the upper unit sphere: the outline, the other rings, the top.
fn place(rings: &[Ring], spacing: f64) -> (Vec<DVec3>, usize) {
    let mut points = Vec::new();
    let mut outline = 0;
    for (row, ring) in rings.iter().enumerate() {
        let around = ring.length() / spacing;
        if row == 0 {
            // Includes both ends of both axes, so that the bump has its full length and breadth.
            outline = 4 * ((around / 4.0).ceil() as usize).max(FEWEST_AROUND / 4);
            points.extend(ring.points(outline, 0.0).map(|p| p.with_z(0.0)));
        } else {
            let count = (around.ceil() as usize).max(3);
            let phase = if row % 2 == 1 { 0.5 } else { 0.0 };
            points.extend(ring.points(count, phase));
        }
    }
    points.push(DVec3::Z);
    (points, outline)
}

/// Joins points of the unit sphere to Delaunay triangles, stretches them and moves them out;
/// also returns the bound of the chord error.
fn connect(
    stretch: &Stretch,
    mut sphere: Vec<DVec3>,
    outline: usize,
    out_mm: f64,
) -> Result<(BumpMesh, f64)> {
    let mut triangles = delaunay(&sphere, outline)?;
    for _ in 0..RELAXATIONS {
        relax(stretch, &mut sphere, outline, &triangles);
        triangles = delaunay(&sphere, outline)?;
    }
    // False if a point of the second row lies outside the chords of the first.
    let fits = triangles.len() == 2 * sphere.len() - outline - 2;
    // Along the normals of the ellipsoid, which are n / radii.
    let outwards = |n: &DVec3| {
        let out = out_mm * stretch.scale(*n);
        n * (1.0 + out / (stretch.0 * stretch.0))
    };
    let moved: Vec<DVec3> = sphere.iter().map(outwards).collect();
    let error_mm = triangles
        .iter()
        .map(|t| stretch.chord_error(t.map(|i| moved[i as usize])))
        .fold(if fits { out_mm } else { f64::INFINITY }, f64::max);
    let bump = BumpMesh {
        points: moved.iter().map(|p| stretch.0 * p).collect(),
        outline,
        triangles,
    };
    Ok((bump, error_mm))
}

/// Triangles of points on the upper unit sphere, the outline first.
fn delaunay(sphere: &[DVec3], outline: usize) -> Result<Vec<[u32; 3]>> {
    // The stereographic projection preserves circles, so Delaunay there is Delaunay on the sphere.
    let flat: Vec<[f64; 2]> = sphere
        .iter()
        .map(|p| (p.truncate() / (1.0 + p.z)).to_array())
        .collect();
    inside(&flat, &sides(0, outline as u32).collect::<Vec<_>>())
}

/// Passes of [`relax`], needed because rings with different numbers of points match badly at first.
const RELAXATIONS: usize = 4;

/// Moves all points except the outline and the top to the mean of the circumcentres around them, weighted by
/// area and the square of the wanted density. This leads to triangles of equal size and shape in the metric
/// [Chen 2004].
fn relax(stretch: &Stretch, sphere: &mut [DVec3], outline: usize, triangles: &[[u32; 3]]) {
    let mut sums = vec![DVec3::ZERO; sphere.len()];
    for triangle in triangles {
        let n = cross(triangle.map(|i| sphere[i as usize]));
        // The circumcentre on the sphere is the normal; its length is twice the area.
        let weight = (stretch.scale(n) * n.length()).powi(2);
        for &i in triangle {
            sums[i as usize] += weight * n;
        }
    }
    let top = sphere.len() - 1;
    for (at, sum) in sphere.iter_mut().zip(sums).take(top).skip(outline) {
        // Circumcentres next to the outline may lie below it.
        if sum.length() > 0.0 && sum.z > 0.0 {
            *at = sum / sum.length();
        }
    }
}

/// Normal of a triangle, as long as twice its area.
fn cross([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Largest ratio of a strip's chord error between the samples to its error at the samples.
const BETWEEN_SAMPLES: f64 = 1.02;

/// Strips between ellipses at equal heights, and a flat top.
///
/// The straight lines of the side join points at the same fraction of the angle around both ellipses.
/// As the ellipses are not similar, the side is twisted between these lines, so a strip split into two
/// triangles has a first-order error. More rows cost less than more points around.
fn cone(texton: &Texton, ask: &Tessellation) -> Result<BumpMesh> {
    let [a, b] = texton.radii().to_array();
    let bend = Stretch(dvec3(a, b, b));
    let even = Ring::new(&bend, vec![0.0; MERIDIANS]);
    let least = even.length() / (8.0 * ask.accuracy_mm).sqrt();
    let least = 4 * ((least / 4.0).ceil() as usize).max(FEWEST_AROUND / 4);
    let mut best: Option<(usize, BumpMesh)> = None;
    for rows in 1..=64 {
        let triangles = |count: usize| count * (2 * rows + 1) - 2;
        let mut count = least;
        while best
            .as_ref()
            .is_none_or(|(fewest, _)| triangles(count) < *fewest)
        {
            let unit: Vec<DVec3> = even.points(count, 0.0).collect();
            let (bump, error_mm) = strips(texton, &unit, rows)?;
            if error_mm <= ask.accuracy_mm {
                best = Some((triangles(count), bump));
                break;
            }
            // The twist shrinks in proportion to the number of points.
            let more = (error_mm / ask.accuracy_mm).min(1.5) * count as f64;
            count = 4 * ((more / 4.0).ceil() as usize).max(count / 4 + 1);
            if triangles(count) as u64 > ask.max_triangles {
                break;
            }
        }
        // Past the best number of rows.
        if best
            .as_ref()
            .is_some_and(|(fewest, _)| triangles(least) >= *fewest)
        {
            break;
        }
    }
    let (_, bump) = best.ok_or(TextonError::TooManyTriangles {
        triangles: ask.max_triangles.saturating_add(1),
        limit: ask.max_triangles,
    })?;
    Ok(bump)
}

/// The cone over points of the unit circle, with its chord error.
fn strips(texton: &Texton, unit: &[DVec3], rows: usize) -> Result<(BumpMesh, f64)> {
    let [a, b] = texton.radii().to_array();
    let [c, d] = texton.top_radii().to_array();
    let n = unit.len();
    let mut points = Vec::with_capacity(n * (rows + 1));
    for row in 0..=rows {
        let t = row as f64 / rows as f64;
        let (x_mm, y_mm) = (a + t * (c - a), b + t * (d - b));
        let z_mm = t * texton.height_mm();
        points.extend(unit.iter().map(|p| dvec3(x_mm * p.x, y_mm * p.y, z_mm)));
    }
    let mut triangles = Vec::with_capacity(n * (2 * rows + 1));
    let mut worst: f64 = 0.0;
    for row in 0..rows {
        for i in 0..n {
            let at = |r: usize, i: usize| ((row + r) * n + i % n) as u32;
            let [p, q, r, s] = [at(0, i), at(0, i + 1), at(1, i + 1), at(1, i)];
            let ways = [[[p, q, r], [p, r, s]], [[p, q, s], [q, r, s]]];
            let errors = ways.map(|w| {
                let one = |t: [u32; 3]| sampled_mm(texton, t.map(|i| points[i as usize]));
                one(w[0]).max(one(w[1]))
            });
            let better = usize::from(errors[1] < errors[0]);
            worst = worst.max(errors[better]);
            triangles.extend(ways[better]);
        }
    }
    let first = (rows * n) as u32;
    let top: Vec<[f64; 2]> = unit.iter().map(|p| [c * p.x, d * p.y]).collect();
    let top = inside(&top, &sides(0, n as u32).collect::<Vec<_>>())?;
    triangles.extend(top.into_iter().map(|t| t.map(|i| first + i)));
    let bump = BumpMesh {
        points,
        outline: n,
        triangles,
    };
    Ok((bump, worst * BETWEEN_SAMPLES))
}

/// Largest distance from the side of a cone over evenly spread points of a triangle, mm.
fn sampled_mm(texton: &Texton, corners: [DVec3; 3]) -> f64 {
    const N: usize = 6;
    let mut worst: f64 = 0.0;
    for i in 0..=N {
        for j in 0..=N - i {
            let share = [i, j, N - i - j].map(|k| k as f64 / N as f64);
            let p = (0..3).map(|k| share[k] * corners[k]).sum();
            worst = worst.max(texton.side_distance_mm(p));
        }
    }
    worst
}
