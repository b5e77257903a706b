//! Rays at edges, along faces and from faces, points far away, many surfaces, many triangles.

use crate::common::{
    Triangle, brute_distance, brute_ray, bumpy, moeller_trumbore, soup, triangles,
};
use glam::DVec3;
use hwall_scene::{
    ArgumentError, BuildQuality, Scene, SceneError, Surface, SurfaceId, SurfaceKind, SurfaceMesh,
};
use hwall_testkit::{Sampler, Tol, assert_close};

const FAR: DVec3 = DVec3::new(10_000.0, -7_000.0, 3_000.0);

/// Scale of the unit cube and where it stands, m.
const PLACES: [(f64, DVec3); 4] = [
    (1.0, DVec3::ZERO),
    (1e-3, DVec3::ZERO),
    (1e3, DVec3::ZERO),
    (1.0, FAR),
];

fn plain(scene: &Scene) -> Vec<Triangle> {
    triangles(scene).into_iter().map(|(_, t)| t).collect()
}

/// A wall of two triangles at x = 1, one metre square, and one at x = 2 behind it.
fn two_walls() -> Scene {
    let wall = |name: &str, x: f64| {
        let [a, b, c, d] =
            [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)].map(|(y, z)| DVec3::new(x, y, z));
        SurfaceMesh {
            surface: Surface {
                name: name.to_owned(),
                ..Surface::default()
            },
            triangles_m: vec![[a, b, c], [a, c, d]],
        }
    };
    Scene::from_meshes(vec![wall("near", 1.0), wall("far", 2.0)])
        .unwrap()
        .0
}

/// Are the faces at a corner or an edge seen some from the front and some from the back? Then they may end there, and rounding
/// decides whether a ray aimed at it passes them: about 70 of 240,000 do.
fn is_rim(all: &[Triangle], shared: &[DVec3], direction: DVec3) -> bool {
    let at = all.iter().filter(|t| shared.iter().all(|p| t.contains(p)));
    let fronts = at.map(|[a, b, c]| (b - a).cross(c - a).dot(direction) < 0.0);
    let (fronts, backs): (Vec<bool>, Vec<bool>) = fronts.partition(|front| *front);
    !fronts.is_empty() && !backs.is_empty()
}

/// Aimed exactly at a corner or at an edge that faces share: hit where the target is, or before it.
#[test]
fn rays_at_shared_edges_and_corners_hit_at_the_right_distance() {
    for (scale, offset) in PLACES {
        let scene = bumpy(24, 31, 2.0 * scale, offset);
        let all = plain(&scene);
        let mut sampler = Sampler::new(32);
        let (mut aimed, mut passed) = (0, 0);
        while aimed < 1500 {
            let [a, b, _] = all[sampler.index(all.len())];
            let (target, shared) = match sampler.index(3) {
                0 => (a, vec![a]),
                1 => (a.lerp(b, 0.5), vec![a, b]),
                _ => (a.lerp(b, sampler.uniform(0.0, 1.0)), vec![a, b]),
            };
            if (target - offset).truncate().abs().max_element() > 0.9 * scale {
                continue;
            }
            let up = sampler.uniform(0.05, 2.0);
            let side = sampler.unit_vector() * 0.5;
            let origin = target + (side + DVec3::Z * (up + 0.5)) * scale;
            let direction = target - origin;
            aimed += 1;
            // Brute force without tolerance may miss the target itself.
            let expected = brute_ray(&all, origin, direction)
                .unwrap_or(f64::INFINITY)
                .min(origin.distance(target));
            let near = 1e-14 * offset.length() + 1e-13 * scale;
            let hit = scene.ray_cast(origin, direction).unwrap();
            let Some(hit) = hit.filter(|hit| hit.distance_m <= expected + 1e3 * near) else {
                assert!(is_rim(&all, &shared, direction), "a leak at {target:?}");
                passed += 1;
                continue;
            };
            let oblique = hit.normal.dot(-direction.normalize()).max(1e-3);
            assert_close!(hit.distance_m, expected, Tol::abs(near / oblique));
        }
        assert!(passed * 200 <= aimed, "{passed} of {aimed} passed a rim");
    }
}

/// The closest point to a point beside an edge or corner lies on that edge or corner.
#[test]
fn closest_points_at_edges_corners_and_on_faces() {
    for (scale, offset) in PLACES {
        let scene = soup(33, 150, scale, offset);
        let all = plain(&scene);
        let tol = Tol::abs(1e-14 * offset.length() + 1e-13 * scale);
        let mut sampler = Sampler::new(34);
        for _ in 0..1000 {
            let [a, b, c] = all[sampler.index(all.len())];
            let on = match sampler.index(3) {
                0 => a,
                1 => a.lerp(b, sampler.uniform(0.0, 1.0)),
                _ => a.lerp(b, 0.3).lerp(c, sampler.uniform(0.0, 1.0)),
            };
            let there = scene.closest_point(on, f64::INFINITY).unwrap().unwrap();
            assert_close!(there.distance_m, 0.0, tol);
            let beside = on + sampler.unit_vector() * 1e-6 * scale;
            let there = scene.closest_point(beside, f64::INFINITY).unwrap().unwrap();
            let expected = all.iter().map(|t| brute_distance(beside, t));
            assert_close!(
                there.distance_m,
                expected.fold(f64::INFINITY, f64::min),
                tol
            );
        }
    }
}

/// Beyond a few sizes of the scene distances are compared in another way.
#[test]
fn closest_points_of_a_far_hand() {
    let scene = bumpy(20, 35, 2.0, DVec3::ZERO);
    let all = plain(&scene);
    let mut sampler = Sampler::new(36);
    for away in [1.9, 2.1, 10.0, 1e3, 1e6] {
        for _ in 0..100 {
            let p = sampler.unit_vector() * away;
            let there = scene.closest_point(p, f64::INFINITY).unwrap().unwrap();
            let expected = all.iter().map(|t| brute_distance(p, t));
            let expected = expected.fold(f64::INFINITY, f64::min);
            assert_close!(there.distance_m, expected, Tol::abs(1e-14 * away + 1e-14));
            assert_eq!(scene.closest_point(p, 0.999 * expected), Ok(None));
        }
    }
    let too_far = scene.closest_point(DVec3::X * 1e200, f64::INFINITY);
    assert!(
        matches!(
            too_far,
            Err(SceneError::Argument(ArgumentError::OutOfRange {
                what: "distance",
                ..
            }))
        ),
        "{too_far:?}"
    );
    let too_far = scene.project_on(SurfaceId(0), DVec3::X * 1e200);
    assert!(
        matches!(
            too_far,
            Err(SceneError::Argument(ArgumentError::OutOfRange {
                what: "distance",
                ..
            }))
        ),
        "{too_far:?}"
    );
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
            assert_eq!(
                (scene.surface(hit.surface).name.as_str(), hit.normal),
                ("near", DVec3::NEG_X)
            );
            let expected = brute_ray(&all, origin, direction).unwrap();
            assert_close!(hit.distance_m, expected, Tol::abs(1e-14 / angle));
            assert_close!(hit.point_m.x, 1.0, Tol::abs(1e-15));
        }
    }
    // In the plane of the wall there is no side to see.
    for direction in [DVec3::Y, DVec3::NEG_Z, DVec3::new(0.0, 1.0, 1.0)] {
        let origin = DVec3::new(1.0, 0.5, 0.5) - 2.0 * direction;
        assert_eq!(scene.ray_cast(origin, direction), Ok(None));
        assert_eq!(scene.any_hit(origin, direction, 9.0), Ok(false));
    }
}

/// From a point just found on a surface: the surface itself at no distance, or what comes next.
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
            assert_eq!(
                scene.any_hit(on, direction, 0.0),
                Ok(false),
                "[0, 0) is empty"
            );
        }
    }
    for (scale, offset) in PLACES {
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
            let distances = all
                .iter()
                .filter_map(|t| moeller_trumbore(on, direction, t));
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

/// Rays, closest points and projections where a door stands now.
#[test]
fn doors_at_many_openings() {
    let mut scene = soup(40, 240, 1.0, DVec3::new(3.0, 1.0, -2.0));
    let middle = DVec3::new(3.0, 1.0, -2.0);
    let door = scene.find("door").unwrap();
    let mut sampler = Sampler::new(41);
    for step in 0..=12 {
        scene
            .set_opening(door, -3.0 + 0.5 * f64::from(step))
            .unwrap();
        let all = triangles(&scene);
        for _ in 0..150 {
            let p = middle + sampler.unit_vector() * sampler.uniform(0.0, 4.0);
            let distance = |accept: &dyn Fn(SurfaceId) -> bool| {
                let kept = all.iter().filter(|(id, _)| accept(*id));
                kept.map(|(_, t)| brute_distance(p, t))
                    .fold(f64::INFINITY, f64::min)
            };
            let tol = Tol::abs(1e-13);
            let any = scene.closest_point(p, f64::INFINITY).unwrap().unwrap();
            assert_close!(any.distance_m, distance(&|_| true), tol);
            let touchable = scene.closest_touchable(p, f64::INFINITY).unwrap().unwrap();
            let wanted = |id: SurfaceId| scene.surface(id).touchable();
            assert_close!(touchable.distance_m, distance(&wanted), tol);
            let on_door = scene.project_on(door, p).unwrap();
            assert_close!(on_door.distance_m, distance(&|id| id == door), tol);

            let direction = middle + sampler.unit_vector() - p;
            let plain = all.iter().map(|&(_, t)| t).collect::<Vec<_>>();
            let expected = brute_ray(&plain, p, direction);
            let hit = scene.ray_cast(p, direction).unwrap();
            assert_eq!(hit.is_some(), expected.is_some());
            if let (Some(hit), Some(expected)) = (hit, expected) {
                let oblique = hit.normal.dot(-direction.normalize()).max(1e-6);
                assert_close!(hit.distance_m, expected, Tol::abs(1e-13 / oblique));
            }
        }
    }
}

/// More surfaces than a hierarchy can tell apart by itself.
#[test]
fn two_hundred_surfaces() {
    let mut sampler = Sampler::new(42);
    let meshes = (0..200).map(|id| {
        let middle = sampler.point_in_box(DVec3::splat(-1.0), DVec3::ONE);
        let triangle = |_| [(); 3].map(|()| middle + sampler.unit_vector() * 0.2);
        SurfaceMesh {
            surface: Surface {
                name: format!("surface {id}"),
                kind: if id % 3 == 0 {
                    SurfaceKind::Untouchable
                } else {
                    SurfaceKind::Static
                },
                ..Surface::default()
            },
            triangles_m: (0..2 + id % 7).map(triangle).collect(),
        }
    });
    let (scene, _) = Scene::from_meshes(meshes.collect()).unwrap();
    let all = triangles(&scene);
    for _ in 0..300 {
        let p = sampler.unit_vector() * sampler.uniform(0.0, 4.0);
        let nearest = |accept: &dyn Fn(SurfaceId) -> bool| {
            let kept = all.iter().filter(|(id, _)| accept(*id));
            kept.map(|(_, t)| brute_distance(p, t))
                .fold(f64::INFINITY, f64::min)
        };
        for id in (0..8).map(|_| SurfaceId(sampler.index(200))) {
            let projected = scene.project_on(id, p).unwrap();
            assert_eq!(projected.surface, id);
            assert_close!(projected.distance_m, nearest(&|s| s == id), Tol::abs(1e-13));
        }
        let touchable = scene.closest_touchable(p, f64::INFINITY).unwrap().unwrap();
        let wanted = |id: SurfaceId| scene.surface(id).touchable();
        assert_close!(touchable.distance_m, nearest(&wanted), Tol::abs(1e-13));
        assert!(wanted(touchable.surface));
    }
}

/// The quality of the build changes times, never answers.
#[test]
fn every_build_quality_gives_the_same_answers() {
    let mut scene = soup(43, 600, 1.0, DVec3::ZERO);
    let door = scene.find("door").unwrap();
    scene.set_opening(door, 0.5).unwrap();
    let others = [
        BuildQuality::Fast,
        BuildQuality::Balanced,
        BuildQuality::Best,
    ]
    .map(|quality| scene.with_build_quality(quality));
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
        let hit = scene
            .ray_cast(above, DVec3::NEG_Z)
            .unwrap()
            .expect("the sheet");
        // A cell of 1 cm bends by 1e-5 m, and the file has four decimals.
        assert_close!(hit.point_m.z, surface, Tol::abs(2e-4));
        let closest = scene.closest_point(above, 2.0).unwrap().unwrap();
        assert!(closest.distance_m <= hit.distance_m + 1e-15);
    }
}
