//! Speed of the queries: `cargo bench -p hwall-scene`. Their error is tested against brute force.

use glam::DVec3;
use hwall_scene::{Bounds, Scene, Surface, SurfaceId, SurfaceMesh};
use hwall_testkit::{Machine, Sampler, shared, time_batches, time_each};

const RAYS: usize = 20_000;

/// A bumpy sphere of about `2 n²` triangles around the origin, radius 1 m.
fn bumpy_sphere(n: usize) -> Scene {
    let mut sampler = Sampler::new(1);
    let radii: Vec<f64> = (0..n * (n + 1))
        .map(|_| sampler.uniform(0.98, 1.0))
        .collect();
    let vertex = |i: usize, j: usize| {
        let (polar, turn) = (
            i as f64 / n as f64 * std::f64::consts::PI * 0.999,
            (j % n) as f64 / n as f64 * std::f64::consts::TAU,
        );
        let direction = DVec3::new(
            polar.sin() * turn.cos(),
            polar.sin() * turn.sin(),
            polar.cos(),
        );
        direction * radii[i * n + j % n]
    };
    let cells = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let triangles_m = cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            ];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let surface = Surface {
        name: "sphere".to_owned(),
        ..Surface::default()
    };
    Scene::from_meshes(vec![SurfaceMesh {
        surface,
        triangles_m,
    }])
    .expect("triangles")
    .0
}

/// Rays between random points of the box (incoherent), or a camera that sweeps it (coherent).
fn rays(scene: &Scene, coherent: bool) -> Vec<(DVec3, DVec3)> {
    let mut sampler = Sampler::new(2);
    let Bounds {
        min_m: min,
        max_m: max,
    } = scene.bounds();
    let side = (RAYS as f64).sqrt().ceil() as usize;
    (0..RAYS)
        .map(|i| {
            if coherent {
                let eye = min + (max - min) * DVec3::new(0.5, 0.5, 0.6);
                let (u, v) = (
                    (i % side) as f64 / side as f64 - 0.5,
                    (i / side) as f64 / side as f64 - 0.5,
                );
                (eye, DVec3::new(1.0, u, v))
            } else {
                let from = sampler.point_in_box(min, max);
                (from, sampler.point_in_box(min, max) - from)
            }
        })
        .collect()
}

fn report(name: &str, scene: &Scene) {
    for coherent in [true, false] {
        let rays = rays(scene, coherent);
        let kind = if coherent { "coherent" } else { "incoherent" };
        let rate = |method: &str, cast: &dyn Fn(DVec3, DVec3) -> bool| {
            let hits = rays.iter().filter(|(o, d)| cast(*o, *d)).count();
            let total = time_batches(20, RAYS / 20, |i| cast(rays[i % RAYS].0, rays[i % RAYS].1));
            let tail = time_each(RAYS, |i| cast(rays[i].0, rays[i].1));
            println!(
                "| {name} | {method}, {kind} | {:.2} | {:.2} | {:.3} | {:.3} | {:.0} % |",
                1e3 / total.median_ns,
                1e3 / total.min_ns,
                tail.median_ns / 1e3,
                tail.p99_ns / 1e3,
                100.0 * hits as f64 / RAYS as f64
            );
        };
        rate("ray", &|o, d| {
            scene.ray_cast(o, d).is_ok_and(|h| h.is_some())
        });
        rate("any hit", &|o, d| {
            scene.any_hit(o, d, f64::INFINITY).unwrap_or(false)
        });
    }
    let points: Vec<DVec3> = rays(scene, false).into_iter().map(|(o, _)| o).collect();
    let size = |id: &usize| scene.triangles_m(SurfaceId(*id)).map_or(0, |t| t.len());
    let largest = SurfaceId((0..scene.surfaces().len()).max_by_key(size).unwrap_or(0));
    let closest = time_each(RAYS, |i| scene.closest_point(points[i], f64::INFINITY));
    let projected = time_each(RAYS, |i| scene.project_on(largest, points[i]));
    for (method, timing) in [
        ("closest point", closest),
        ("on the largest surface", projected),
    ] {
        println!(
            "| {name} | {method} | | | {:.3} | {:.3} | |",
            timing.median_ns / 1e3,
            timing.p99_ns / 1e3
        );
    }
}

fn main() {
    println!("{}", Machine::detect(1));
    println!(
        "n = {RAYS}, rays from seed 2\n\n| scene | method | Mrays/s | best batch | median µs | p99 µs | hits |\n| --- | --- | --- | --- | --- | --- | --- |"
    );
    report("bumpy sphere, 100k", &bumpy_sphere(224));
    // Real scenes, if the data are beside the project.
    let Some(folder) = shared("data/scene") else {
        return;
    };
    for name in ["small_house_collision.obj", "small_house_visual.obj"] {
        let started = std::time::Instant::now();
        match Scene::from_obj_file(folder.join(name), None) {
            Ok((scene, _)) => {
                println!(
                    "{name}: {} triangles, loaded in {:.2} s",
                    scene.triangle_count(),
                    started.elapsed().as_secs_f64()
                );
                report(name, &scene);
            }
            Err(e) => println!("skipped {name}: {e}"),
        }
    }
}
