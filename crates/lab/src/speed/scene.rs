//! Ray casts and closest points: speed against error, by the quality of the hierarchy.

use crate::report::{Gap, titled};
use crate::speed::section::{Section, batches, median_and_p99, quoted};
use anyhow::Context;
use glam::DVec3;
use hwall_scene::{Bounds, BuildQuality, Scene, Surface, SurfaceId, SurfaceMesh};
use hwall_testkit::{
    ErrorStats, Sampler, Timing, format_error, format_ns, time_batches, time_each,
};
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// Balls in the room.
const BALLS: usize = 60;

const ROOM_OBJ: &str = include_str!("../../../../examples/assets/room.obj");

/// Repetitions of a build; the median counts.
const BUILDS: usize = 3;

/// Number of calls; the median counts.
const TOGETHER: usize = 30;

/// Largest number of triangle tests for brute force; limits the rays and points compared.
const BRUTE: usize = 100_000_000;

/// Distances that differ by more are different hits, m.
const ELSEWHERE_M: f64 = 1e-9;

/// Origin, m, and direction.
type Ray = (DVec3, DVec3);

/// Every build quality on scenes of increasing size, or on one given scene.
///
/// # Errors
/// A scene that cannot be read.
pub fn build_quality(seed: u64, n: usize, scene: Option<&Path>) -> anyhow::Result<Section> {
    let scenes = match scene {
        Some(path) => vec![Scene::from_obj_file(path, None)?.0],
        None => [3, 10, 35]
            .into_iter()
            .map(|rings| room_of_balls(seed, rings))
            .collect::<anyhow::Result<_>>()?,
    };
    let mut table = titled(
        "triangles | quality | build | memory | coherent rays | incoherent rays | median, p99 | closest point | on one surface \
         | rays elsewhere | largest error | coherent together | incoherent together",
    );
    let mut summary = Vec::new();
    let m_per_s = |timing: &Timing| format!("{:.2} M/s", 1e3 / timing.median_ns);
    for scene in &scenes {
        let oracle = Oracle::new(scene, seed);
        let triangles = scene.triangle_count();
        let incoherent = incoherent(scene, &mut Sampler::new(seed), n);
        let coherent = coherent(scene, n);
        let surfaces = scene.surfaces().len();
        for quality in [
            BuildQuality::Fast,
            BuildQuality::Balanced,
            BuildQuality::Best,
        ] {
            let build = time_each(BUILDS, |_| scene.with_build_quality(quality));
            let scene = scene.with_build_quality(quality);
            let cast = |rays: &[Ray], i: usize| scene.ray_cast(rays[i % n].0, rays[i % n].1);
            let along = batches(|i| cast(&coherent, i));
            let across = batches(|i| cast(&incoherent, i));
            let near = batches(|i| scene.closest_point(incoherent[i % n].0, f64::INFINITY));
            let on_one = time_batches(200, 100, |i| {
                scene.project_on(SurfaceId(i % surfaces), incoherent[i % n].0)
            });
            let errors = oracle.compare(&scene)?;
            let elsewhere = format!("{} of {}", errors.elsewhere, oracle.rays.len());
            let largest = format_error(errors.largest_m, "m");
            table.row([
                triangles.to_string(),
                format!("{quality:?}"),
                format!("{:.3} s", 1e-9 * build.median_ns),
                format!("{:.1} MB", 1e-6 * scene.geometry_bytes() as f64),
                m_per_s(&along),
                m_per_s(&across),
                median_and_p99(&across).join(", "),
                median_and_p99(&near).join(", "),
                format_ns(on_one.median_ns),
                elsewhere.clone(),
                largest.clone(),
                together_m_per_s(&scene, &coherent)?,
                together_m_per_s(&scene, &incoherent)?,
            ]);
            if quality != BuildQuality::default() {
                continue;
            }
            let quote = |what: &str, timing, error| {
                let what = format!("{what}, {triangles} triangles");
                quoted("scene", &what, timing, error)
            };
            let error = format!("{largest}; {elsewhere} rays elsewhere");
            summary = vec![
                quote("incoherent ray cast", &across, error),
                quote("closest point", &near, largest),
            ];
        }
    }
    let gaps: [Gap<'_>; 4] = [
        ("balls", &BALLS),
        ("n", &n),
        ("elsewhere", &format_args!("{ELSEWHERE_M:.0e}")),
        ("table", &table),
    ];
    Section::of(include_str!("text/scene.md"), &gaps, summary)
}

/// Millions of rays a second, all in one call.
fn together_m_per_s(scene: &Scene, rays: &[Ray]) -> anyhow::Result<String> {
    let ray = |&(origin_m, direction): &Ray| hwall_scene::Ray {
        origin_m,
        direction,
    };
    let rays: Vec<_> = rays.iter().map(ray).collect();
    let mut hits = Vec::new();
    scene.ray_casts(&rays, &mut hits)?;
    for (ray, hit) in rays.iter().zip(&hits) {
        let alone = scene.ray_cast(ray.origin_m, ray.direction)?;
        anyhow::ensure!(alone == *hit, "{ray:?} meets {hit:?}, alone {alone:?}");
    }
    let timing = time_each(TOGETHER, |_| scene.ray_casts(&rays, &mut hits));
    let m_per_s = 1e3 * rays.len() as f64 / timing.median_ns;
    Ok(format!("{m_per_s:.2} M/s"))
}

/// Brute-force results, computed once per scene.
struct Oracle {
    rays: Vec<(Ray, Option<f64>)>,
    points: Vec<(DVec3, f64)>,
}

struct Errors {
    elsewhere: usize,
    largest_m: f64,
}

impl Oracle {
    fn new(scene: &Scene, seed: u64) -> Self {
        let mut sampler = Sampler::new(seed + 1);
        let triangles: Vec<[DVec3; 3]> = (0..scene.surfaces().len())
            .filter_map(|id| scene.triangles_m(SurfaceId(id)).ok())
            .flatten()
            .collect();
        let n = (BRUTE / 2 / triangles.len()).clamp(100, 10_000);
        let rays = incoherent(scene, &mut sampler, n);
        // Distances to triangles take longer than rays.
        let points = rays.iter().take(n.div_ceil(4)).map(|&(point, _)| {
            let distances = triangles.iter().map(|t| distance_m(point, t));
            (point, distances.fold(f64::INFINITY, f64::min))
        });
        let points = points.collect();
        let hit = |ray| (ray, first_hit_m(ray, &triangles));
        let rays = rays.into_iter().map(hit).collect();
        Self { rays, points }
    }

    fn compare(&self, scene: &Scene) -> anyhow::Result<Errors> {
        let (mut elsewhere, mut errors) = (0, Vec::new());
        for &((origin, direction), expected_m) in &self.rays {
            match (scene.ray_cast(origin, direction)?, expected_m) {
                (Some(hit), Some(m)) if (hit.distance_m - m).abs() < ELSEWHERE_M => {
                    errors.push(hit.distance_m - m);
                }
                (None, None) => {}
                _ => elsewhere += 1,
            }
        }
        for &(point, expected_m) in &self.points {
            let closest = scene.closest_point(point, f64::INFINITY)?;
            errors.push(closest.context("nothing is closest")?.distance_m - expected_m);
        }
        Ok(Errors {
            elsewhere,
            largest_m: ErrorStats::from_errors(errors).max,
        })
    }
}

/// Möller and Trumbore 1997 over all triangles.
fn first_hit_m((origin, direction): Ray, triangles: &[[DVec3; 3]]) -> Option<f64> {
    let d = direction.normalize();
    let distance = |&[a, b, c]: &[DVec3; 3]| {
        let (e1, e2, s) = (b - a, c - a, origin - a);
        let (p, q) = (d.cross(e2), s.cross(e1));
        let det = e1.dot(p);
        let (u, v, t) = (s.dot(p) / det, d.dot(q) / det, e2.dot(q) / det);
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
    };
    triangles.iter().filter_map(distance).min_by(f64::total_cmp)
}

/// Distance of a point from a triangle, m: to its plane if the foot lies inside, else to the nearest side.
fn distance_m(p: DVec3, t: &[DVec3; 3]) -> f64 {
    let normal = (t[1] - t[0]).cross(t[2] - t[0]);
    let side = |i: usize| (t[i], t[(i + 1) % 3] - t[i]);
    let inside = |i: usize| {
        let (a, d) = side(i);
        d.cross(p - a).dot(normal) >= 0.0
    };
    if inside(0) && inside(1) && inside(2) {
        return (p - t[0]).dot(normal).abs() / normal.length();
    }
    let to_side = |i: usize| {
        let (a, d) = side(i);
        p.distance(a + d * ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0))
    };
    to_side(0).min(to_side(1)).min(to_side(2))
}

/// From random points of the box of a scene to others.
fn incoherent(scene: &Scene, sampler: &mut Sampler, n: usize) -> Vec<Ray> {
    let Bounds { min_m, max_m } = scene.bounds();
    let ray = |_| {
        let from = sampler.point_in_box(min_m, max_m);
        (from, sampler.point_in_box(min_m, max_m) - from)
    };
    (0..n).map(ray).collect()
}

/// A square image with a field of view of 90 degrees, row by row, from within the scene.
fn coherent(scene: &Scene, n: usize) -> Vec<Ray> {
    let Bounds { min_m, max_m } = scene.bounds();
    let eye = min_m + (max_m - min_m) * DVec3::new(0.5, 0.5, 0.6);
    let side = (n as f64).sqrt().ceil() as usize;
    let at = |i: usize| 2.0 * i as f64 / side as f64 - 1.0;
    (0..n)
        .map(|i| (eye, DVec3::new(1.0, at(i % side), at(i / side))))
        .collect()
}

/// The built-in room with floating balls of many sizes, `2 rings²` triangles each.
fn room_of_balls(seed: u64, rings: usize) -> anyhow::Result<Scene> {
    let (room, _) = Scene::from_obj_str(ROOM_OBJ, None)?;
    let Bounds { min_m, max_m } = room.bounds();
    let mut meshes = Vec::new();
    for (id, surface) in room.surfaces().iter().enumerate() {
        meshes.push(SurfaceMesh {
            surface: surface.clone(),
            triangles_m: room.triangles_m(SurfaceId(id))?.collect(),
        });
    }
    let mut sampler = Sampler::new(seed);
    for ball in 0..BALLS {
        let middle = sampler.point_in_box(min_m, max_m);
        let radius = sampler.uniform(0.02, 0.3);
        let triangles = bumpy_ball(&mut sampler, rings).into_iter();
        meshes.push(SurfaceMesh {
            surface: Surface {
                name: format!("ball {ball}"),
                ..Surface::default()
            },
            triangles_m: triangles.map(|t| t.map(|p| middle + p * radius)).collect(),
        });
    }
    Ok(Scene::from_meshes(meshes)?.0)
}

/// A ball about the origin, of radius 0.97 to 1; without its poles.
fn bumpy_ball(sampler: &mut Sampler, rings: usize) -> Vec<[DVec3; 3]> {
    let bumps: Vec<f64> = (0..(rings + 1) * rings)
        .map(|_| sampler.uniform(0.97, 1.0))
        .collect();
    let vertex = |i: usize, j: usize| {
        let polar = PI * (0.001 + 0.998 * i as f64 / rings as f64);
        let turn = TAU * (j % rings) as f64 / rings as f64;
        let flat = DVec3::new(turn.cos(), turn.sin(), 0.0) * polar.sin();
        (flat + DVec3::Z * polar.cos()) * bumps[i * rings + j % rings]
    };
    let cells = (0..rings).flat_map(|i| (0..rings).map(move |j| (i, j)));
    cells
        .flat_map(|(i, j)| {
            let (a, b) = (vertex(i, j), vertex(i + 1, j));
            let (c, d) = (vertex(i + 1, j + 1), vertex(i, j + 1));
            [[a, b, c], [a, c, d]]
        })
        .collect()
}
