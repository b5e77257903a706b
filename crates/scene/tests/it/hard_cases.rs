//! Rays at edges, along faces and from faces, points far away, many surfaces, many triangles.

use crate::common::{
    PLACES, Triangle, brute_closest, brute_ray, bumpy, moeller_trumbore, plain_surface, soup,
    triangles,
};
use glam::DVec3;
use hwall_scene::{ArgumentError, BuildQuality, Scene, SceneError, SurfaceId, SurfaceKind};
use hwall_testkit::{Sampler, Tol, assert_close};

fn plain(scene: &Scene) -> Vec<Triangle> {
    triangles(scene).into_iter().map(|(_, t)| t).collect()
}

/// A wall of two triangles at x = 1, one metre square, and one at x = 2 behind it.
fn two_walls() -> Scene {
    let wall = |name: &str, x: f64| {
        let [a, b, c, d] =
            [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)].map(|(y, z)| DVec3::new(x, y, z));
        plain_surface(name, vec![[a, b, c], [a, c, d]])
    };
    let walls = vec![wall("near", 1.0), wall("far", 2.0)];
    Scene::from_meshes(walls).unwrap().0
}

/// The closest point to a point beside an edge or corner lies on that edge or corner.
#[test]
fn closest_points_at_edges_corners_and_on_faces() {
    for (scale, offset) in PLACES.into_iter().take(4) {
        let scene = soup(33, 150, scale, offset);
        let all = triangles(&scene);
        let tol = Tol::abs(1e-14 * offset.length() + 1e-13 * scale);
        let mut sampler = Sampler::new(34);
        for _ in 0..1000 {
            let (_, [a, b, c]) = all[sampler.index(all.len())];
            let on = match sampler.index(3) {
                0 => a,
                1 => a.lerp(b, sampler.uniform(0.0, 1.0)),
                _ => a.lerp(b, 0.3).lerp(c, sampler.uniform(0.0, 1.0)),
            };
            let there = scene.closest_point(on, f64::INFINITY).unwrap().unwrap();
            assert_close!(there.distance_m, 0.0, tol);
            let beside = on + sampler.unit_vector() * 1e-6 * scale;
            let there = scene.closest_point(beside, f64::INFINITY).unwrap().unwrap();
            let expected = brute_closest(&all, beside, |_| true);
            assert_close!(there.distance_m, expected, tol);
        }
    }
}

/// Far from the scene distances are compared by another method.
#[test]
fn closest_points_of_a_far_hand() {
    let scene = bumpy(20, 35, 2.0, DVec3::ZERO);
    let all = triangles(&scene);
    let mut sampler = Sampler::new(36);
    for away in [1.9, 2.1, 10.0, 1e3, 1e6] {
        for _ in 0..100 {
            let p = sampler.unit_vector() * away;
            let there = scene.closest_point(p, f64::INFINITY).unwrap().unwrap();
            let expected = brute_closest(&all, p, |_| true);
            assert_close!(there.distance_m, expected, Tol::abs(1e-14 * away + 1e-14));
            assert_eq!(scene.closest_point(p, 0.999 * expected), Ok(None));
        }
    }
    let far = DVec3::X * 1e200;
    let closest = scene.closest_point(far, f64::INFINITY);
    let projected = scene.project_on(SurfaceId(0), far);
    for too_far in [closest.unwrap_err(), projected.unwrap_err()] {
        let SceneError::Argument(ArgumentError::OutOfRange { what, .. }) = too_far else {
            panic!("{too_far}");
        };
        assert_eq!(what, "distance");
    }
}

#[test]
fn grazing_rays() {
    let scene = two_walls();
    let all = plain(&scene);
    let mut sampler = Sampler::new(37);
    for angle in [1e-1, 1e-3, 1e-5, 1e-7, 1e-9] {
        for _ in 0..300 {
            let along = DVec3::new(0.0, sampler.uniform(-1.0, 1.0), sampler.uniform(-1.0, 1.0));
            let target = DVec3::new(1.0, sampler.uniform(0.1, 0.9), sampler.uniform(0.1, 0.9));
            let direction = along.normalize() + DVec3::X * angle;
            let origin = target - direction * sampler.uniform(0.01, 3.0);
            let hit = scene.ray_cast(origin, direction).unwrap().expect("a wall");
            let name = scene.surface(hit.surface).name.as_str();
            assert_eq!((name, hit.normal), ("near", DVec3::NEG_X));
            let expected = brute_ray(&all, origin, direction).unwrap();
            assert_close!(hit.distance_m, expected, Tol::abs(1e-14 / angle));
            assert_close!(hit.point_m.x, 1.0, Tol::abs(1e-15));
        }
    }
    // In the plane of the wall there is no visible side.
    for direction in [DVec3::Y, DVec3::NEG_Z, DVec3::new(0.0, 1.0, 1.0)] {
        let origin = DVec3::new(1.0, 0.5, 0.5) - 2.0 * direction;
        assert_eq!(scene.ray_cast(origin, direction), Ok(None));
        assert_eq!(scene.any_hit(origin, direction, 9.0), Ok(false));
    }
}

/// From a point just found on a surface: the surface itself at zero distance, or the next one.
#[test]
fn rays_that_start_on_a_surface() {
    let scene = two_walls();
    for x in [1.0, 2.0] {
        let on = DVec3::new(x, 0.3, 0.6);
        for direction in [DVec3::X, DVec3::NEG_X, DVec3::new(1.0, 0.1, 0.2)] {
            let hit = scene.ray_cast(on, direction).unwrap().expect("itself");
            assert_eq!(hit.distance_m, 0.0);
            assert_close!(hit.point_m, on, Tol::abs(1e-15));
            assert_eq!(scene.any_hit(on, direction, 1e-9), Ok(true));
            // [0, 0) is empty.
            assert_eq!(scene.any_hit(on, direction, 0.0), Ok(false));
        }
    }
    for (scale, offset) in PLACES.into_iter().take(4) {
        let scene = soup(38, 150, scale, offset);
        let all = plain(&scene);
        let mut sampler = Sampler::new(39);
        let tol = 1e-13 * scale + 1e-14 * offset.length();
        for _ in 0..1000 {
            let [a, b, c] = all[sampler.index(all.len())];
            let (s, t) = (sampler.uniform(0.1, 0.5), sampler.uniform(0.1, 0.5));
            let on = a + (b - a) * s + (c - a) * t;
            let direction = sampler.unit_vector();
            let steep = (b - a).cross(c - a).normalize().dot(direction).abs();
            if steep < 0.05 {
                continue;
            }
            let itself = 100.0 * tol / steep;
            let distance = |t| moeller_trumbore(on, direction, t);
            let distances = all.iter().filter_map(distance);
            let next = distances.filter(|d| *d > itself).min_by(f64::total_cmp);
            let hit = scene.ray_cast(on, direction).unwrap().map(|h| h.distance_m);
            match (hit, next) {
                (Some(hit), _) if hit <= itself => {}
                (Some(hit), Some(next)) => assert_close!(hit, next, Tol::rel(1e-9)),
                (None, None) => {}
                other => panic!("{other:?}"),
            }
        }
    }
}

/// More surfaces than bits in the hierarchy.
#[test]
fn two_hundred_surfaces() {
    let mut sampler = Sampler::new(42);
    let meshes = (0..200).map(|id| {
        let middle = sampler.point_in_box(DVec3::splat(-1.0), DVec3::ONE);
        let triangle = |_| [(); 3].map(|()| middle + sampler.unit_vector() * 0.2);
        let triangles_m = (0..2 + id % 7).map(triangle).collect();
        let mut mesh = plain_surface(&format!("surface {id}"), triangles_m);
        if id % 3 == 0 {
            mesh.surface.kind = SurfaceKind::Untouchable;
        }
        mesh
    });
    let (scene, _) = Scene::from_meshes(meshes.collect()).unwrap();
    let all = triangles(&scene);
    for _ in 0..300 {
        let p = sampler.unit_vector() * sampler.uniform(0.0, 4.0);
        for id in (0..8).map(|_| SurfaceId(sampler.index(200))) {
            let projected = scene.project_on(id, p).unwrap();
            assert_eq!(projected.surface, id);
            let expected = brute_closest(&all, p, |s| s == id);
            assert_close!(projected.distance_m, expected, Tol::abs(1e-13));
        }
        let touchable = scene.closest_touchable(p, f64::INFINITY).unwrap().unwrap();
        let wanted = |id: SurfaceId| scene.surface(id).touchable();
        let expected = brute_closest(&all, p, wanted);
        assert_close!(touchable.distance_m, expected, Tol::abs(1e-13));
        assert!(wanted(touchable.surface));
    }
}

/// The build quality affects times, never results.
#[test]
fn every_build_quality_gives_the_same_answers() {
    let mut scene = soup(43, 600, 1.0, DVec3::ZERO);
    let door = scene.find("door").unwrap();
    scene.set_opening(door, 0.5).unwrap();
    use BuildQuality::{Balanced, Best, Fast};
    let others = [Fast, Balanced, Best].map(|quality| scene.with_build_quality(quality));
    let mut sampler = Sampler::new(44);
    for other in &others {
        assert_eq!(other.triangle_count(), scene.triangle_count());
        assert_eq!(other.opening(door), Some(0.5));
        for _ in 0..1000 {
            let p = sampler.unit_vector() * sampler.uniform(0.0, 3.0);
            let direction = sampler.unit_vector();
            assert_eq!(other.ray_cast(p, direction), scene.ray_cast(p, direction));
            let project = |scene: &Scene| scene.project_on(door, p).map(|c| c.distance_m);
            assert_eq!(project(other), project(&scene));
        }
    }
}

/// A million triangles as a file: read, built and queried within bounded memory.
#[test]
fn a_million_triangles() {
    use std::fmt::Write as _;
    let n = 708;
    let mut obj = String::from("o sheet\n");
    for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
        let (x, y) = (f64::from(i) * 0.01, f64::from(j) * 0.01);
        let _ = writeln!(obj, "v {x:.2} {y:.2} {:.4}", 0.1 * x.sin() * y.cos());
    }
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let a = i * (n + 1) + j + 1;
        let _ = writeln!(obj, "f {} {} {} {}", a, a + n + 1, a + n + 2, a + 1);
    }
    let (scene, report) = Scene::from_obj_str(&obj, None).unwrap();
    assert!(report.is_clean(), "{report:?}");
    assert_eq!(scene.triangle_count(), 2 * (n * n) as usize);
    let bytes = scene.geometry_bytes() / scene.triangle_count();
    assert!(bytes < 160, "{bytes} bytes a triangle");
    let mut sampler = Sampler::new(45);
    for _ in 0..1000 {
        let (x, y) = (sampler.uniform(0.1, 7.0), sampler.uniform(0.1, 7.0));
        let surface = 0.1 * x.sin() * y.cos();
        let above = DVec3::new(x, y, 1.0);
        let hit = scene.ray_cast(above, DVec3::NEG_Z).unwrap();
        let hit = hit.expect("the sheet");
        // A cell of 1 cm bends by 1e-5 m, and the file has four decimals.
        assert_close!(hit.point_m.z, surface, Tol::abs(2e-4));
        let closest = scene.closest_point(above, 2.0).unwrap().unwrap();
        assert!(closest.distance_m <= hit.distance_m + 1e-15);
    }
}
