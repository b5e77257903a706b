//! Ray casts and closest points in scenes of increasing size.

use crate::speed::section::{Section, batches, median_and_p99, quoted};
use glam::DVec3;
use hwall_scene::{Bounds, BuildQuality, Ray, Scene, Surface, SurfaceId, SurfaceMesh};
use hwall_testkit::{Sampler, time_each, titled};
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// Balls in the room.
const BALLS: usize = 60;

const ROOM_OBJ: &str = include_str!("../../../../examples/assets/room.obj");

/// Repetitions of a build; the median counts.
const BUILDS: usize = 3;

/// What the tests of the crate (tests/it/oracle.rs) allow in a scene of this size.
const ERROR: &str = "1e-13 m against brute force, by test";

/// Scenes of increasing size, or one given scene.
///
/// # Errors
/// A scene that cannot be read.
pub fn queries(seed: u64, n: usize, scene: Option<&Path>) -> anyhow::Result<Section> {
    let scenes = match scene {
        Some(path) => vec![Scene::from_obj_file(path, None)?.0],
        None => [3, 10, 35]
            .into_iter()
            .map(|rings| room_of_balls(seed, rings))
            .collect::<anyhow::Result<_>>()?,
    };
    let mut table =
        titled("triangles | build | memory | incoherent rays | median, p99 | closest point");
    let mut summary = Vec::new();
    for scene in &scenes {
        let triangles = scene.triangle_count();
        let incoherent = incoherent(scene, &mut Sampler::new(seed), n);
        let build = time_each(BUILDS, |_| {
            scene.with_build_quality(BuildQuality::default())
        });
        let cast = |ray: &Ray| scene.ray_cast(ray.origin_m, ray.direction);
        let across = batches(|i| cast(&incoherent[i % n]));
        let point_m = |i: usize| incoherent[i % n].origin_m;
        let near = batches(|i| scene.closest_point(point_m(i), f64::INFINITY));
        table.row([
            triangles.to_string(),
            format!("{:.3} s", 1e-9 * build.median_ns),
            format!("{:.1} MB", 1e-6 * scene.geometry_bytes() as f64),
            format!("{:.2} M/s", 1e3 / across.median_ns),
            median_and_p99(&across).join(", "),
            median_and_p99(&near).join(", "),
        ]);
        let quote = |what: &str, timing| {
            quoted(
                "scene",
                &format!("{what}, {triangles} triangles"),
                timing,
                ERROR,
            )
        };
        summary = vec![
            quote("incoherent ray cast", &across),
            quote("closest point", &near),
        ];
    }
    Section::of(include_str!("text/scene.md"), summary).filled(&[
        ("balls", &BALLS),
        ("n", &n),
        ("table", &table),
    ])
}

/// From random points of the box of a scene to others.
fn incoherent(scene: &Scene, sampler: &mut Sampler, n: usize) -> Vec<Ray> {
    let Bounds { min_m, max_m } = scene.bounds();
    let ray = |_| {
        let origin_m = sampler.point_in_box(min_m, max_m);
        let direction = sampler.point_in_box(min_m, max_m) - origin_m;
        Ray {
            origin_m,
            direction,
        }
    };
    (0..n).map(ray).collect()
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
