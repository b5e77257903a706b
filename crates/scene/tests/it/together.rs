//! Many rays at once: every hit is bit-identical to that of the single ray.

use crate::common::{assert_non_finite, bumpy, plain_surface, soup, triangles};
use glam::DVec3;
use hwall_scene::{Hit, Ray, Scene, SceneError};
use hwall_testkit::Sampler;

/// Anywhere, at corners and edges, along axes and faces, from afar, of any length.
fn rays(scene: &Scene, seed: u64, n: usize) -> Vec<Ray> {
    let mut sampler = Sampler::new(seed);
    let all = triangles(scene);
    let bounds = scene.bounds();
    let middle = 0.5 * (bounds.min_m + bounds.max_m);
    let size = bounds.max_m - bounds.min_m;
    let ray = |_| {
        let (_, [a, b, c]) = all[sampler.index(all.len())];
        let target = match sampler.index(5) {
            0 => a,
            1 => a.lerp(b, sampler.uniform(0.0, 1.0)),
            2 => (a + b + c) / 3.0,
            _ => middle + size * sampler.unit_vector(),
        };
        let direction = match sampler.index(4) {
            0 => DVec3::AXES[sampler.index(3)],
            1 => -DVec3::AXES[sampler.index(3)],
            2 if b != a => b - a,
            _ => sampler.unit_vector(),
        };
        let length = 10.0_f64.powf(sampler.uniform(-200.0, 200.0));
        let back = size.length() * [0.0, 1e-9, 1.0, 1e4][sampler.index(4)];
        Ray {
            origin_m: target - direction.normalize() * back,
            direction: direction.normalize() * length,
        }
    };
    (0..n).map(ray).collect()
}

fn alone(scene: &Scene, rays: &[Ray]) -> Vec<Option<Hit>> {
    let cast = |ray: &Ray| scene.ray_cast(ray.origin_m, ray.direction).unwrap();
    rays.iter().map(cast).collect()
}

/// Slices of all lengths around the thresholds of the search; returns the number of hits.
fn compare(scene: &Scene, seed: u64) -> usize {
    let rays = rays(scene, seed, 2000);
    let alone = alone(scene, &rays);
    let mut hits = Vec::new();
    for length in [0, 1, 31, 32, 33, 63, 255, 256, 257, 600, 2000] {
        for start in [0, 17] {
            let slice = start..(start + length).min(rays.len());
            scene.ray_casts(&rays[slice.clone()], &mut hits).unwrap();
            assert_eq!(hits, alone[slice]);
        }
    }
    alone.iter().flatten().count()
}

#[test]
fn in_plain_scenes_of_every_size_and_place() {
    for (seed, (scale, offset)) in [
        (1.0, DVec3::ZERO),
        (1e-3, DVec3::ZERO),
        (1e3, DVec3::new(10_000.0, -7_000.0, 3_000.0)),
    ]
    .into_iter()
    .enumerate()
    {
        let seed = 70 + seed as u64;
        let hits = compare(&bumpy(24, seed, 2.0 * scale, offset), seed);
        assert!(hits > 400, "{hits}");
        let hits = compare(&soup(seed, 400, scale, offset), seed);
        assert!(hits > 400, "{hits}");
    }
}

/// Several parts, with varying ones in front.
#[test]
fn past_a_door_that_opens() {
    let mut scene = soup(73, 240, 1.0, DVec3::new(3.0, 1.0, -2.0));
    let door = scene.find("door").unwrap();
    for step in 0..=12 {
        let opening = -3.0 + 0.5 * f64::from(step);
        scene.set_opening(door, opening).unwrap();
        compare(&scene, 80 + step as u64);
    }
}

/// Slivers, tiny faces, faces with coinciding boxes, and every face twice on its own edge.
#[test]
fn in_degenerate_scenes() {
    let mut sampler = Sampler::new(74);
    let mut triangles_m = Vec::new();
    for i in 0..2000 {
        let x = f64::from(i) * 1e-13;
        triangles_m.push([DVec3::X * x, DVec3::X * (1.0 + x), DVec3::new(x, 1.0, 0.0)]);
    }
    for _ in 0..300 {
        let middle = sampler.point_in_box(DVec3::splat(-1.0), DVec3::ONE);
        let along = sampler.unit_vector();
        let height = 10.0_f64.powf(sampler.uniform(-9.0, -1.0));
        let aside = 0.3 * along + height * sampler.unit_vector();
        triangles_m.push([middle, middle + along, middle + aside]);
        triangles_m.push([(); 3].map(|()| middle + height * sampler.unit_vector()));
    }
    let heap = plain_surface("heap", triangles_m);
    let (scene, _) = Scene::from_meshes(vec![heap]).unwrap();
    let hits = compare(&scene, 75);
    assert!(hits > 400, "{hits}");
    let (one, _) = Scene::from_obj_str("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3", None).unwrap();
    assert!(compare(&one, 76) > 400);
}

/// For any position of the invalid ray.
#[test]
fn a_bad_ray_is_an_error_and_leaves_no_hits() {
    let scene = bumpy(8, 77, 2.0, DVec3::ZERO);
    let good = rays(&scene, 78, 600);
    let mut hits = Vec::new();
    for at in [0, 40, 300, 599] {
        let mut rays = good.clone();
        rays[at].origin_m.y = f64::NAN;
        scene.ray_casts(&good, &mut hits).unwrap();
        assert_non_finite(scene.ray_casts(&rays, &mut hits));
        assert!(hits.is_empty());
        rays[at] = Ray {
            origin_m: DVec3::ZERO,
            direction: DVec3::ZERO,
        };
        let refused = scene.ray_casts(&rays, &mut hits);
        assert_eq!(refused, Err(SceneError::ZeroDirection));
        assert!(hits.is_empty());
    }
}

/// From far away rounding puts the search bound before its origin; a door is a separate part behind the hit.
#[test]
fn from_very_far_away() {
    let text = "o wall\nv 0.7 -1 0\nv 0.7 1 0\nv 0.7 1 2\nv 0.7 -1 2\nf 1 2 3 4\n\
                o door\nv 0.7001 -1 0\nv 0.7001 1 0\nv 0.7001 1 2\nv 0.7001 -1 2\nf 5 6 7 8\n";
    let sidecar = "[surface.door]\nkind = \"revolving_door\"\nhinge_point_m = [0.7001, -1.0, 0.0]\nhinge_axis = [0.0, 0.0, 1.0]\nrange_deg = [0.0, 90.0]\n";
    let (scene, _) = Scene::from_obj_str(text, Some(sidecar)).unwrap();
    for far_m in [1e9, 1e10, 1e11, 1e12, 1e14, 1e15] {
        let rays: Vec<Ray> = (0..40)
            .map(|k| Ray {
                origin_m: DVec3::new(-far_m, 0.01 * f64::from(k), 1.0),
                direction: DVec3::X,
            })
            .collect();
        let mut hits = Vec::new();
        scene.ray_casts(&rays, &mut hits).unwrap();
        assert_eq!(hits, alone(&scene, &rays), "{far_m}");
    }
}
