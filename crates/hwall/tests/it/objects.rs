//! From the surfaces of a scene to objects that can be pushed.

use hwall::geometry::Pose;
use hwall::glam::DVec3;
use hwall::haptics::{Click, Detent, MovingObject, ObjectPath};
use hwall::scene::{Scene, SurfaceId};
use hwall::{object_of, objects_of};
use hwall_testkit::{Tol, assert_close};

const ROOM: &str = "
v 1 0 0\nv 1 1 0\nv 1 1 1
o wall\nf 1 2 3
o door\nf 1 2 3
o panel\nf 1 2 3
o drawer\nf 1 2 3
o button\nf 1 2 3
o floor\nf 1 2 3";

const OLD: &str = r#"
[surface.door]
kind = "revolving_door"
hinge_point_m = [1, 0, 0]
hinge_axis = [0, 0, 2]
range_deg = [0, 90]
[surface.panel]
kind = "sliding_panel"
direction = [0, 1, 0]
range_m = [-0.5, 0.25]
stiffness_n_per_m = 30
[surface.drawer]
kind = "drawer"
direction = [-1, 0, 0]
range_m = [0, 0.4]
[surface.button]
kind = "button"
direction = [1, 0, 0]
range_m = [0, 0.008]
[surface.floor]
kind = "untouchable"
"#;

#[test]
fn what_a_sidecar_leaves_out_has_the_documented_values() {
    let (scene, _) = Scene::from_obj_str(ROOM, Some(OLD)).unwrap();
    let objects = objects_of(&scene).unwrap();
    let expected = [
        (1, 4.3, 0.0, 2.0, [0.0, std::f64::consts::FRAC_PI_2]),
        (2, 10.0, 30.0, 10.0, [-0.5, 0.25]),
        (3, 3.0, 0.0, 10.0, [0.0, 0.4]),
        (4, 0.05, 400.0, 3.0, [0.0, 0.008]),
    ];
    assert_eq!(objects.len(), expected.len());
    for (object, expected) in objects.iter().zip(expected) {
        let (surface, c) = (object.surface.0, &object.config);
        let numbers = (surface, c.inertia, c.stiffness, c.damping, c.range);
        assert_eq!(numbers, expected);
        assert_eq!((c.friction, c.rest, c.restitution), (0.0, 0.0, 0.0));
        assert!(c.detents.is_empty() && c.click.is_none());
        assert!(MovingObject::new(c.clone()).is_ok());
    }
    assert_eq!(object_of(&scene, SurfaceId(0)).unwrap(), None);
    assert_eq!(object_of(&scene, SurfaceId(5)).unwrap(), None);
    assert!(object_of(&scene, SurfaceId(6)).is_err());
}

#[test]
fn all_that_a_sidecar_says_arrives() {
    let sidecar = r#"
[surface.door]
kind = "revolving_door"
hinge_point_m = [1, 0, 0]
hinge_axis = [0, 0, 1]
range_deg = [-10, 90]
rest_deg = 90
inertia_kg_m2 = 3.5
stiffness_n_m_per_rad = 2
damping_n_m_s_per_rad = 1.5
friction_n_m = 0.25
restitution = 0.1
detents = [{ position_deg = 0, half_width_deg = 180, torque_n_m = 6 }]
[surface.button]
kind = "button"
direction = [1, 0, 0]
range_m = [0, 0.008]
mass_kg = 0.02
friction_n = 0.1
roughness = 0.3
click = { start_m = 0.001, snap_m = 0.003, force_n = 4 }
detents = [{ position_m = 0.008, half_width_m = 0.001, force_n = 2 }]
"#;
    let (scene, _) = Scene::from_obj_str(ROOM, Some(sidecar)).unwrap();
    let config_of = |name: &str| {
        let object = object_of(&scene, scene.find(name).unwrap()).unwrap();
        object.unwrap().0
    };
    let detent = |position: f64, half_width: f64, force: f64| Detent {
        position,
        half_width,
        force,
    };
    let (door, quarter) = (config_of("door"), std::f64::consts::FRAC_PI_2);
    let numbers = [door.inertia, door.stiffness, door.damping];
    assert_eq!(numbers, [3.5, 2.0, 1.5]);
    let numbers = [door.rest, door.friction, door.restitution];
    assert_eq!(numbers, [quarter, 0.25, 0.1]);
    assert_eq!(door.detents, [detent(0.0, 2.0 * quarter, 6.0)]);
    let button = config_of("button");
    assert_eq!((button.inertia, button.friction), (0.02, 0.1));
    // Without a release, all stored energy is lost.
    let click = Click {
        start: 0.001,
        snap: 0.003,
        release: 0.001,
        force: 4.0,
    };
    assert_eq!(button.click, Some(click));
    assert_eq!(button.detents, [detent(0.008, 0.001, 2.0)]);
}

#[test]
fn an_object_moves_as_the_opening_of_its_surface() {
    let (scene, _) = Scene::from_obj_str(ROOM, Some(OLD)).unwrap();
    let world = Pose::from_yaw(0.7, DVec3::new(0.3, -2.0, 0.5)).unwrap();
    for scene in [scene.clone(), scene.placed(&world)] {
        for object in objects_of(&scene).unwrap() {
            let [_, most] = object.config.range;
            let corner = |s: &Scene| s.triangles_m(object.surface).unwrap().next().unwrap()[1];
            let mut open = scene.clone();
            open.set_opening(object.surface, most).unwrap();
            let before = Pose::IDENTITY.at(corner(&scene));
            let after = object.path.moved(&before, most).position_m();
            assert_close!(after, corner(&open), Tol::abs(1e-14));
        }
    }
    let (_, path) = object_of(&scene, SurfaceId(1)).unwrap().unwrap();
    assert_eq!(path, ObjectPath::turning(DVec3::X, DVec3::Z).unwrap());
}
