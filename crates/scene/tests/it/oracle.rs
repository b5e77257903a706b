//! Rays and closest points against brute force over all triangles in f64.

use crate::common::{
    PLACES, Triangle, brute_closest, brute_distance, brute_ray, bumpy, room, soup, triangles,
};
use glam::{DQuat, DVec3};
use hwall_scene::{Pose, Scene};
use hwall_testkit::{ErrorStats, Sampler, Tol, assert_close};

/// Allowed error from the coordinates (f64 in file and result) and the size.
fn tolerance(scale: f64, offset: DVec3) -> f64 {
    1e-14 * offset.length() + 1e-13 * scale
}

/// A ray towards the scene from inside, nearby and far away.
fn ray(sampler: &mut Sampler, scale: f64, offset: DVec3) -> (DVec3, DVec3) {
    let away = [0.5, 2.0, 100.0][sampler.index(3)];
    let origin = sampler.unit_vector() * away * scale;
    let target = sampler.point_in_box(DVec3::splat(-1.0), DVec3::ONE) * scale;
    // The direction may have any length.
    let length = sampler.uniform(0.1, 10.0);
    (offset + origin, (target - origin) * length)
}

/// Compares `n` rays with brute force; returns the number that disagree on hit or miss or on the nearest face.
fn compare_rays(scene: &Scene, n: usize, seed: u64, scale: f64, offset: DVec3) -> usize {
    let all = triangles(scene);
    let plain: Vec<Triangle> = all.iter().map(|&(_, t)| t).collect();
    let mut sampler = Sampler::new(seed);
    let close = tolerance(scale, offset);
    let (mut disagreements, mut errors) = (0, Vec::new());
    for _ in 0..n {
        let (origin, direction) = ray(&mut sampler, scale, offset);
        let hit = scene.ray_cast(origin, direction).unwrap();
        let expected = brute_ray(&plain, origin, direction);
        match (hit, expected) {
            (None, None) => {}
            (Some(hit), Some(t)) => {
                // For a grazing ray the uncertainty of the distance grows with the obliqueness of the face.
                let oblique = hit.normal.dot(-direction.normalize()).max(1e-6);
                let far = 100.0 * scale + offset.length();
                let error = (hit.distance_m - t).abs();
                if error > (close + 1e-14 * far) / oblique {
                    disagreements += 1;
                    continue;
                }
                errors.push(error / scale);
                let on_ray = origin + direction.normalize() * hit.distance_m;
                let aside = hit.point_m.distance(on_ray);
                assert!(aside < close + 1e-14 * far, "off the ray");
                let distances = plain.iter().map(|t| brute_distance(hit.point_m, t));
                let nearest = distances.fold(f64::INFINITY, f64::min);
                assert!(nearest < close, "{nearest} off its triangle");
                assert_close!(hit.normal.length(), 1.0, Tol::abs(1e-14));
                let away = hit.normal.dot(direction);
                assert!(away <= 0.0, "normal away from the viewer");
            }
            _ => disagreements += 1,
        }
    }
    let hits = errors.len();
    let stats = ErrorStats::from_errors(errors);
    println!("scale {scale}, {offset}: {hits} hits, {disagreements} disagree, {stats:?}");
    assert!(hits > n / 4, "the rays are meant to hit");
    disagreements
}

#[test]
fn rays_find_what_brute_force_finds() {
    for (scale, offset) in PLACES {
        let scene = soup(1, 300, scale, offset);
        assert_eq!(compare_rays(&scene, 4000, 2, scale, offset), 0);
        let fine = bumpy(40, 3, 2.0 * scale, offset);
        assert_eq!(compare_rays(&fine, 2000, 4, scale, offset), 0);
    }
}

#[test]
fn closest_points_are_those_of_brute_force() {
    for (scale, offset) in PLACES {
        let mut scene = soup(5, 300, scale, offset);
        let door = scene.find("door").unwrap();
        scene.set_opening(door, -0.7).unwrap();
        let all = triangles(&scene);
        let mut sampler = Sampler::new(6);
        for _ in 0..1000 {
            let p = offset + sampler.unit_vector() * sampler.uniform(0.0, 3.0) * scale;
            let tol = Tol::abs(tolerance(scale, offset));
            let any = scene.closest_point(p, f64::INFINITY).unwrap().unwrap();
            assert_close!(any.distance_m, brute_closest(&all, p, |_| true), tol);
            assert_close!(any.point_m.distance(p), any.distance_m, tol);
            let towards = any.normal.dot(p - any.point_m);
            assert!(towards >= 0.0, "normal away from the point");
            let touchable = scene.closest_touchable(p, f64::INFINITY).unwrap().unwrap();
            let wanted = |id| scene.surface(id).touchable();
            assert!(wanted(touchable.surface));
            assert_close!(touchable.distance_m, brute_closest(&all, p, wanted), tol);
            let projected = scene.project_on(door, p).unwrap();
            let expected = brute_closest(&all, p, |id| id == door);
            assert_close!(projected.distance_m, expected, tol);
            // The limit excludes only what is beyond it.
            let near = any.distance_m * 0.999 - 2.0 * tol.abs;
            let wide = any.distance_m * 1.001 + 2.0 * tol.abs;
            assert_eq!(scene.closest_point(p, near).unwrap(), None);
            assert_eq!(scene.closest_point(p, wide).unwrap(), Some(any));
        }
    }
}

#[test]
fn an_open_door_is_hit_where_it_stands() {
    let mut scene = soup(7, 300, 1.0, DVec3::ZERO);
    let door = scene.find("door").unwrap();
    let closed: Vec<Triangle> = scene.triangles_m(door).unwrap().collect();
    for opening in [-3.0, -0.7, 0.4, 3.0] {
        scene.set_opening(door, opening).unwrap();
        assert_eq!(scene.opening(door), Some(opening));
        let turn = DQuat::from_rotation_z(opening);
        for (now, before) in scene.triangles_m(door).unwrap().zip(&closed) {
            for (a, b) in now.iter().zip(before) {
                assert_close!(*a, turn * *b, Tol::abs(1e-14));
            }
        }
        assert_eq!(compare_rays(&scene, 1500, 8, 1.0, DVec3::ZERO), 0);
    }
}

#[test]
fn placing_moves_everything_and_changes_nothing_else() {
    let mut scene = soup(9, 300, 1.0, DVec3::ZERO);
    let door = scene.find("door").unwrap();
    scene.set_opening(door, 0.5).unwrap();
    let mut sampler = Sampler::new(10);
    let pose = Pose::new(sampler.rotation(), DVec3::new(3.0, -2.0, 1.0)).unwrap();
    let mut placed = scene.placed(&pose);
    for opening in [0.5, -1.0] {
        scene.set_opening(door, opening).unwrap();
        placed.set_opening(door, opening).unwrap();
        for _ in 0..1000 {
            let (origin, direction) = ray(&mut sampler, 1.0, DVec3::ZERO);
            let here = scene.ray_cast(origin, direction).unwrap();
            let direction = pose.transform_vector(direction);
            let there = placed.ray_cast(pose.transform_point(origin), direction);
            let there = there.unwrap();
            assert_eq!(here.is_some(), there.is_some());
            if let (Some(here), Some(there)) = (here, there) {
                assert_eq!((here.surface, here.outside), (there.surface, there.outside));
                let point_m = pose.transform_point(here.point_m);
                assert_close!(point_m, there.point_m, Tol::abs(1e-12));
                let normal = pose.transform_vector(here.normal);
                assert_close!(normal, there.normal, Tol::abs(1e-12));
            }
        }
    }
    let back = placed.placed(&pose.inverse());
    let original: Vec<_> = triangles(&scene);
    for ((_, a), (_, b)) in triangles(&back).iter().zip(&original) {
        for (a, b) in a.iter().zip(b) {
            assert_close!(*a, *b, Tol::abs(1e-13));
        }
    }
}

#[test]
fn the_room_is_seen_as_brute_force_sees_it() {
    let Some(mut scene) = room() else { return };
    let door = scene.find("door").unwrap();
    for opening in [0.0, 0.6] {
        scene.set_opening(door, opening).unwrap();
        let middle = DVec3::new(1.5, 0.2, 0.6);
        assert_eq!(compare_rays(&scene, 4000, 11, 1.0, middle), 0);
    }
}

/// A line is blocked by what a ray along it hits before its end.
#[test]
fn any_hit_and_visible_agree_with_the_ray() {
    let scene = soup(12, 300, 1.0, DVec3::ZERO);
    let mut sampler = Sampler::new(13);
    let corner = DVec3::splat(1.5);
    for _ in 0..4000 {
        let [a, b] = [(); 2].map(|()| sampler.point_in_box(-corner, corner));
        let hit = scene.ray_cast(a, b - a).unwrap();
        let blocked = hit.is_some_and(|h| h.distance_m < a.distance(b));
        assert_eq!(scene.visible(a, b).unwrap(), !blocked);
        assert_eq!(scene.any_hit(a, b - a, a.distance(b)).unwrap(), blocked);
        if let Some(hit) = hit {
            // A point seen is visible.
            assert!(scene.visible(a, hit.point_m).unwrap());
        }
    }
}
