//! What stands in this room, what does a person look at, and what is nearest to the hand?
//!
//! `cargo run -p hwall-scene --example ask_a_room` (or `-- room.obj` for a room of your own)

use hwall_scene::{Scene, SceneError, SurfaceId, glam::DVec3};

const ROOM: &str = "
o wall
v 0.8 -2 0\nv 0.8 2 0\nv 0.8 2 2.4\nv 0.8 -2 2.4
f 1 4 3 2
o cupboard
v 0.6 0.5 0\nv 0.6 0 0\nv 0.6 0 1.8\nv 0.6 0.5 1.8
f 5 8 7 6
o floor
v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0
f 9 10 11 12";

const SIDECAR: &str = r#"
[surface.cupboard]
kind = "revolving_door"
hinge_point_m = [0.6, 0.5, 0]
hinge_axis = [0, 0, -1]
range_deg = [0, 100]
roughness = 0.3
[surface.floor]
kind = "untouchable""#;

fn main() -> Result<(), SceneError> {
    let (mut room, report) = match std::env::args().nth(1) {
        Some(path) => Scene::from_obj_file(path, None)?,
        None => Scene::from_obj_str(ROOM, Some(SIDECAR))?,
    };
    println!(
        "{} triangles, clean: {}",
        room.triangle_count(),
        report.is_clean()
    );
    for (id, surface) in room.surfaces().iter().enumerate() {
        let area_m2: f64 = room
            .triangles_m(SurfaceId(id))?
            .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length())
            .sum();
        println!(
            "- {}: {}, {area_m2:.6} m²",
            surface.name,
            surface.kind.name()
        );
    }
    for facet in room.vertical_facets() {
        let name = &room.surface(facet.surface).name;
        println!(
            "{name}: {:.2} m wide, {:.2} m²",
            facet.width_m, facet.area_m2
        );
    }

    let (eye_m, hand_m) = (DVec3::new(-0.4, 0.2, 1.6), DVec3::new(0.3, 0.1, 1.2));
    let look = |room: &Scene| -> Result<(), SceneError> {
        let name = |surface: SurfaceId| room.surface(surface).name.clone();
        match room.ray_cast(eye_m, DVec3::new(1.0, 0.0, -0.3))? {
            Some(hit) => println!("in sight: {} at {:.3} m", name(hit.surface), hit.point_m),
            None => println!("in sight: nothing"),
        }
        if let Some(near) = room.closest_touchable(hand_m, 1.0)? {
            println!(
                "nearest to the hand: {}, {:.3} m",
                name(near.surface),
                near.distance_m
            );
        }
        Ok(())
    };
    look(&room)?;
    if let Some(door) = room.find("cupboard") {
        room.set_opening(door, 90_f64.to_radians())?; // nothing is rebuilt
        println!("with the cupboard open,");
        look(&room)?;
    }
    Ok(())
}
