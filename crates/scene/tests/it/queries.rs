//! The room of the examples, facets, openings, bad queries, and a real scene.

use crate::common::{assert_non_finite, room};
use glam::DVec3;
use hwall_scene::{Bounds, Pose, Scene, SceneError, SlidingPart, SurfaceId, SurfaceKind};
use hwall_testkit::{Tol, assert_close};

/// The person's eyes.
const EYE: DVec3 = DVec3::new(1.5, 0.0, 1.0);

#[test]
fn the_room_faces_the_person() {
    let Some(room) = room() else { return };
    for id in (0..room.surfaces().len()).map(SurfaceId) {
        let name = &room.surface(id).name;
        for [a, b, c] in room.triangles_m(id).unwrap() {
            let (middle, normal) = ((a + b + c) / 3.0, (b - a).cross(c - a).normalize());
            let outward = match name.as_str() {
                "pedestal" => middle - DVec3::new(0.0, 0.0, -0.3),
                "shelf_top" | "shelf_sides" => middle - DVec3::new(0.65, -0.325, 0.325),
                _ => EYE - middle,
            };
            assert!(normal.dot(outward) > 0.0, "{name}: {normal}");
        }
    }
    let Bounds { min_m, max_m } = room.bounds();
    assert_close!(min_m, DVec3::new(-0.43, -1.2, -0.6), Tol::abs(1e-15));
    assert_close!(max_m, DVec3::new(3.0, 1.6, 1.8), Tol::abs(1e-15));
}

#[test]
fn a_person_in_the_room_finds_what_is_there() {
    let Some(mut room) = room() else { return };
    let look = |room: &Scene, at: DVec3| {
        let hit = room.ray_cast(EYE, at - EYE).unwrap().unwrap();
        assert!(hit.outside);
        (room.surface(hit.surface).name.clone(), hit)
    };
    let (name, hit) = look(&room, DVec3::new(0.62, 0.0, 0.4));
    assert_eq!((name.as_str(), hit.normal), ("front_wall", DVec3::X));
    assert_close!(hit.point_m, DVec3::new(0.62, 0.0, 0.4), Tol::abs(1e-14));
    assert_eq!(look(&room, DVec3::new(0.74, -0.3, 0.3)).0, "shelf_front");
    assert_eq!(look(&room, DVec3::new(0.68, -0.3, 0.45)).0, "shelf_top");
    let (name, hit) = look(&room, DVec3::new(0.5, 0.36, 0.4));
    assert_eq!(name, "door");
    assert_close!(hit.normal, DVec3::new(0.8, 0.6, 0.0), Tol::abs(1e-14));

    // Opened by 15 degrees, the door has turned towards the arm, behind its closed position.
    let door = room.find("door").unwrap();
    room.set_opening(door, 15_f64.to_radians()).unwrap();
    let (name, open) = look(&room, DVec3::new(0.5, 0.36, 0.4));
    assert!(name == "door" && open.distance_m > hit.distance_m + 0.05);
    let turned_deg = open.normal.angle_between(hit.normal).to_degrees();
    assert_close!(turned_deg, 15.0, Tol::abs(5e-11));

    // A hand near the floor touches the nearest wall, not the floor.
    let hand = DVec3::new(0.9, 0.0, -0.55);
    let any = room.closest_point(hand, 1.0).unwrap().unwrap();
    let touchable = room.closest_touchable(hand, 1.0).unwrap().unwrap();
    let names = [any, touchable].map(|hit| room.surface(hit.surface).name.as_str());
    assert_eq!(names, ["floor", "front_wall"]);
    // From behind the wall, the person's side is the far one.
    let behind = DVec3::new(0.6, 0.0, 0.4);
    let behind = room.closest_touchable(behind, 1.0).unwrap().unwrap();
    assert!(!behind.outside && behind.normal == DVec3::NEG_X);
}

#[test]
fn facets_of_the_room() {
    let Some(room) = room() else { return };
    let facets = room.vertical_facets();
    assert!(facets.is_sorted_by(|a, b| a.area_m2 >= b.area_m2));
    let of = |name: &str| -> Vec<_> {
        let id = room.find(name).unwrap();
        facets.iter().filter(|p| p.surface == id).collect()
    };
    let [wall] = of("front_wall")[..] else {
        panic!("one facet")
    };
    assert_eq!((wall.normal, wall.outline_m.len()), (DVec3::X, 4));
    assert_close!(wall.lowest_m, -0.6, Tol::abs(1e-15));
    assert_close!(wall.highest_m, 1.8, Tol::abs(1e-15));
    assert_close!(wall.area_m2, 1.4 * 2.4, Tol::abs(1e-12));
    assert_close!(wall.width_m, 1.4, Tol::abs(1e-12));
    assert_close!(wall.point_m, DVec3::new(0.62, -0.5, 0.6), Tol::abs(1e-12));
    // Counter-clockwise seen from outside.
    let [a, b, c, d] = wall.outline_m[..] else {
        panic!("four corners")
    };
    let area = 0.5 * (c - a).cross(d - b);
    assert_close!(area, wall.normal * wall.area_m2, Tol::abs(1e-12));
    let [door] = of("door")[..] else {
        panic!("one facet")
    };
    assert_close!(door.normal, DVec3::new(0.8, 0.6, 0.0), Tol::abs(1e-14));
    assert_close!(door.width_m, 0.8, Tol::abs(1e-12));
    // Beside and above the door: one plane, joined at a corner, without the doorway.
    let [door_wall] = of("door_wall")[..] else {
        panic!("one facet")
    };
    assert_close!(door_wall.area_m2, 0.95 * 2.4 + 0.8 * 0.3, Tol::abs(1e-12));
    assert_close!(door_wall.width_m, 1.75, Tol::abs(1e-12));
    assert_eq!(of("shelf_sides").len(), 2);
    assert!(of("floor").is_empty() && of("pedestal").is_empty() && of("shelf_top").is_empty());
}

/// A wall with a window: the centroid is in the window, the point of the facet is on the wall.
#[test]
fn the_point_of_a_facet_lies_on_it() {
    let obj = "v 0 0 0\nv 0 3 0\nv 0 3 3\nv 0 0 3\nv 0 1 1\nv 0 2 1\nv 0 2 2\nv 0 1 2
        f 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8";
    let (scene, _) = Scene::from_obj_str(obj, None).unwrap();
    let facets = scene.vertical_facets();
    let [facet] = &facets[..] else {
        panic!("one facet, got {facets:?}")
    };
    assert_close!(facet.area_m2, 8.0, Tol::abs(1e-12));
    let closest = scene.closest_point(facet.point_m, 1.0).unwrap().unwrap();
    assert_close!(closest.distance_m, 0.0, Tol::abs(1e-15));
    assert_eq!(facet.outline_m.len(), 4);
}

#[test]
fn openings_stay_in_range() {
    let Some(mut room) = room() else { return };
    let (door, wall) = (room.find("door").unwrap(), room.find("front_wall").unwrap());
    let openings = [door, wall, SurfaceId(99)].map(|id| room.opening(id));
    assert_eq!(openings, [Some(0.0), None, None]);
    let range = room.set_opening(door, -0.1).unwrap_err();
    let SceneError::OpeningOutOfRange { value, min, .. } = range else {
        panic!("{range}");
    };
    assert_eq!((value, min), (-0.1, 0.0));
    assert_non_finite(room.set_opening(door, f64::NAN));
    assert!(matches!(
        room.set_opening(wall, 0.0),
        Err(SceneError::NotMovable { .. })
    ));
    assert!(matches!(
        room.set_opening(SurfaceId(99), 0.0),
        Err(SceneError::UnknownSurface { index: 99, .. })
    ));
    assert_eq!(room.opening(door), Some(0.0));
    room.set_opening(door, 60_f64.to_radians()).unwrap();
}

#[test]
fn a_sliding_panel_slides() {
    let obj = "o panel\nv 1 0 0\nv 1 1 0\nv 1 1 1\nv 1 0 1\nf 1 2 3 4";
    let sidecar =
        "[surface.panel]\nkind = \"sliding_panel\"\ndirection = [0, 3, 0]\nrange_m = [-0.5, 2]";
    let (mut scene, _) = Scene::from_obj_str(obj, Some(sidecar)).unwrap();
    let panel = SurfaceId(0);
    assert!(matches!(
        scene.surface(panel).kind,
        SurfaceKind::Sliding {
            part: SlidingPart::Panel,
            direction: DVec3::Y,
            ..
        }
    ));
    let ray = |scene: &Scene| {
        let hit = scene.ray_cast(DVec3::new(0.0, 0.5, 0.5), DVec3::X);
        hit.unwrap().is_some()
    };
    assert!(ray(&scene));
    scene.set_opening(panel, 1.5).unwrap();
    assert!(!ray(&scene));
    let moved_m = DVec3::new(1.0, 1.5, 0.0);
    assert_close!(scene.bounds().min_m, moved_m, Tol::abs(1e-15));
    // Placing rotates the direction with the scene.
    let placed = scene.placed(&Pose::from_yaw(1.0, DVec3::ZERO).unwrap());
    let SurfaceKind::Sliding { direction, .. } = placed.surface(panel).kind else {
        panic!()
    };
    let turned = DVec3::new(-1_f64.sin(), 1_f64.cos(), 0.0);
    assert_close!(direction, turned, Tol::abs(1e-15));
    assert_eq!(placed.opening(panel), Some(1.5));
}

#[test]
fn bad_queries_are_errors() {
    let (scene, _) = Scene::from_obj_str("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3", None).unwrap();
    for bad in [DVec3::new(0.0, f64::NAN, 0.0), DVec3::INFINITY] {
        assert_non_finite(scene.ray_cast(bad, DVec3::X));
        assert_non_finite(scene.ray_cast(DVec3::ZERO, bad));
        assert_non_finite(scene.visible(bad, DVec3::X));
        assert_non_finite(scene.visible(DVec3::X, bad));
        assert_non_finite(scene.closest_point(bad, 1.0));
        assert_non_finite(scene.project_on(SurfaceId(0), bad));
    }
    let nowhere = scene.ray_cast(DVec3::ZERO, DVec3::ZERO);
    assert_eq!(nowhere, Err(SceneError::ZeroDirection));
    assert_non_finite(scene.closest_point(DVec3::ZERO, f64::NAN));
    assert_non_finite(scene.any_hit(DVec3::ZERO, DVec3::X, f64::NAN));
    assert_eq!(scene.closest_point(DVec3::ZERO, -1.0), Ok(None));
    assert!(matches!(
        scene.project_on(SurfaceId(1), DVec3::X),
        Err(SceneError::UnknownSurface { .. })
    ));
    assert!(scene.triangles_m(SurfaceId(1)).is_err());
    // Extreme but valid.
    let ray = |origin, direction| {
        let hit = scene.ray_cast(origin, direction).unwrap();
        hit.map(|h| h.distance_m)
    };
    for tiny_or_huge in [1e-300, 1e300, 5e-324, f64::MAX] {
        let direction = DVec3::NEG_Z * tiny_or_huge;
        assert_eq!(ray(DVec3::new(0.25, 0.25, 1.0), direction), Some(1.0));
    }
    assert_eq!(ray(DVec3::splat(f64::MAX), DVec3::X), None);
    assert!(ray(DVec3::new(0.25, 0.25, 1e100), DVec3::NEG_Z).is_some());
    assert_eq!(scene.visible(DVec3::X, DVec3::X), Ok(true));
    // On the surface itself.
    let touching = DVec3::new(0.25, 0.25, 0.0);
    assert_eq!(ray(touching, DVec3::Z), Some(0.0));
    let closest = scene.closest_point(touching, 1.0).unwrap().unwrap();
    assert_eq!((closest.distance_m, closest.normal), (0.0, DVec3::Z));
    assert!(closest.outside);
}

/// A real indoor scene, if the data are beside the project.
#[test]
fn the_small_house() {
    let Some(path) = hwall_testkit::shared("data/scene/small_house_collision.obj") else {
        return;
    };
    let (house, report) = Scene::from_obj_file(&path, None).unwrap();
    println!(
        "{} surfaces, {} triangles, {report:?}",
        house.surfaces().len(),
        house.triangle_count()
    );
    assert!(house.surfaces().len() > 50 && house.triangle_count() > 3500);
    let Bounds { min_m, max_m } = house.bounds();
    assert_close!(max_m - min_m, DVec3::new(19.0, 11.4, 3.0), Tol::abs(0.5));
    let facets = house.vertical_facets();
    assert!(facets.iter().filter(|p| p.area_m2 > 1.0).count() > 20);
    // A bare wall facet is seen from a step in front of it, at the distance of the step.
    let clear = facets.iter().filter(|p| p.area_m2 > 2.0).filter(|p| {
        let eye = p.point_m + p.normal * 0.2;
        let hit = house.ray_cast(eye, -p.normal).unwrap().unwrap();
        assert!(hit.distance_m <= 0.2 + 1e-9);
        hit.surface == p.surface
    });
    assert!(clear.count() > 10);
}
