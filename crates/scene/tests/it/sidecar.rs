//! Sidecars: read completely, found beside their files, mistakes reported by name.

use crate::common::folder::Folder;
use hwall_scene::{Mechanics, Scene, SceneError, SurfaceClick, SurfaceDetent, SurfaceKind};
use std::path::Path;

const TRIANGLE: &str = "o wall\nv 1 0 0\nv 1 1 0\nv 1 0 1\nf 1 2 3\n";

#[test]
fn a_malformed_sidecar_and_an_unknown_surface_are_named() {
    let with = |sidecar: &str| Scene::from_obj_str(TRIANGLE, Some(sidecar)).expect_err(sidecar);
    let (unknown, name) = (with("[surface.door]\nkind = \"static\""), "door".to_owned());
    assert_eq!(unknown, SceneError::SidecarUnknownSurface { name });
    for (text, named) in [
        ("kinds = 1", "kinds"),
        ("default_kind = \"revolving_door\"", "default_kind"),
        ("[surface.wall", "wall"),
    ] {
        let error = with(text);
        assert!(matches!(error, SceneError::SidecarMalformed { .. }));
        assert!(error.to_string().contains(named), "{error}");
    }
}

#[test]
fn the_mechanics_of_all_kinds_are_read() {
    let read = |sidecar: &str| {
        let (scene, _) = Scene::from_obj_str(TRIANGLE, Some(sidecar)).expect(sidecar);
        scene.surfaces()[0].kind.clone()
    };
    let door = read(
        "[surface.wall]\nkind = \"revolving_door\"\nhinge_point_m = [0, 0, 0]\nhinge_axis = [0, 0, 1]\n\
         range_deg = [0, 180]\nrest_deg = -90\ninertia_kg_m2 = 4\nstiffness_n_m_per_rad = 2\n\
         damping_n_m_s_per_rad = 3\nfriction_n_m = 0.5\nrestitution = 1\n\
         detents = [{ position_deg = 0, half_width_deg = 180, torque_n_m = 7 }]",
    );
    let pi = std::f64::consts::PI;
    let expected = Mechanics {
        inertia: Some(4.0),
        stiffness: Some(2.0),
        rest: Some(-0.5 * pi),
        damping: Some(3.0),
        friction: Some(0.5),
        restitution: Some(1.0),
        detents: vec![SurfaceDetent {
            position: 0.0,
            half_width: pi,
            force: 7.0,
        }],
        click: None,
    };
    assert_eq!(door.mechanics(), Some(&expected));
    let sliding = "direction = [0, 2, 0]\nrange_m = [-0.1, 0.5]\nrest_m = 0.1\nmass_kg = 4\n\
         stiffness_n_per_m = 2\ndamping_n_s_per_m = 3\nfriction_n = 0.5\nrestitution = 1\nroughness = 0.3\n\
         detents = [{ position_m = 0, half_width_m = 0.02, force_n = 7 }]";
    let expected = Mechanics {
        rest: Some(0.1),
        detents: vec![SurfaceDetent {
            position: 0.0,
            half_width: 0.02,
            force: 7.0,
        }],
        ..expected
    };
    for name in ["sliding_panel", "drawer", "button"] {
        let kind = read(&format!("[surface.wall]\nkind = {name:?}\n{sliding}"));
        assert_eq!(kind.name(), name);
        assert_eq!(kind.mechanics(), Some(&expected));
        let range = kind.range().unwrap();
        assert_eq!((range.min, range.max), (-0.1, 0.5));
    }
    let click = "click = { start_m = 0.001, snap_m = 0.003, force_n = 4 }";
    let button = format!("[surface.wall]\nkind = \"button\"\n{sliding}\n{click}");
    let kind = read(&button);
    let click = SurfaceClick {
        start: 0.001,
        snap: 0.003,
        release: 0.001,
        force: 4.0,
    };
    assert_eq!(kind.mechanics().unwrap().click, Some(click));
    // Older files do not have it.
    let kind =
        read("[surface.wall]\nkind = \"sliding_panel\"\ndirection = [0, 2, 0]\nrange_m = [0, 1]");
    assert_eq!(kind.mechanics(), Some(&Mechanics::default()));
    assert_eq!(SurfaceKind::Static.mechanics(), None);
}

/// Faults of a kind, and the expected error text.
const MISTAKES: &str = r#"
none   | colour = 3 | colour
none   | kind = "swing" | swing
none   | roughness = "rough" | rough
none   | range_deg = [0, 90] | of kind static has no use for range_deg
none   | kind = "revolving_door"; hinge_point_m = [0, 0, 0]; range_deg = [0, 1] | needs hinge_axis
none   | kind = "revolving_door"; hinge_point_m = [0, 0, 0]; hinge_axis = [0, 0, 0]; range_deg = [0, 9] | hinge_axis is
hinge  | range_deg = [10, 90] | opening range is
hinge  | range_deg = [90, 0] | opening range is
hinge  | range_deg = [0, nan] | opening range is
hinge  | range_deg = [0, 720] | opening range is
door   | direction = [0, 0, 1] | of kind revolving_door has no use for direction
door   | roughness = -1 | roughness is
door   | damping_n_m_s_per_rad = inf | damping_n_m_s_per_rad is
door   | inertia_kg_m2 = 0 | inertia_kg_m2
door   | inertia_kg_m2 = nan | inertia_kg_m2
door   | friction_n_m = -1 | friction_n_m
door   | rest_deg = inf | rest_deg
door   | restitution = 1.5 | restitution
door   | mass_kg = 1 | mass_kg
door   | friction_n = 1 | friction_n
door   | click = { start_m = 0, snap_m = 1, force_n = 1 } | click
door   | detents = [{ position_deg = 0, torque_n_m = 1 }] | detents.half_width_deg
door   | detents = [{ position_deg = 0, half_width_deg = 0, torque_n_m = 1 }] | detents.half_width_deg
door   | detents = [{ position_m = 0 }] | detents.position_m
door   | detents = [{ depth = 0 }] | depth
panel  | mass_kg = -1 | mass_kg
panel  | stiffness_n_per_m = nan | stiffness_n_per_m
panel  | inertia_kg_m2 = 1 | inertia_kg_m2
panel  | click = { start_m = 0, snap_m = 1, force_n = 1 } | click
drawer | hinge_axis = [0, 0, 1] | hinge_axis
drawer | friction_n = inf | friction_n
drawer | detents = [{ position_m = 0, half_width_m = 1, force_n = -1 }] | detents.force_n
drawer | detents = [{ position_m = 0, half_width_m = 1, torque_n_m = 1 }] | detents.torque_n_m
button | click = { start_m = 0.1, snap_m = 0.1, force_n = 1 } | click.snap_m
button | click = { start_m = 0, snap_m = 1, release_m = 2, force_n = 1 } | click.release_m
button | click = { start_m = nan, snap_m = 1, force_n = 1 } | click.start_m
button | click = { start_m = 0, snap_m = 1, force_n = -1 } | click.force_n
button | click = { start_m = 0, force_n = 1 } | snap_m
button | click = { start_m = 0, snap_m = 1, force_n = 1, noise = 2 } | noise
none   | kind = "static"; restitution = 1 | restitution
none   | kind = "static"; mass_kg = 1 | mass_kg
none   | kind = "untouchable"; detents = [] | detents
none   | kind = "drawer"; direction = [1, 0, 0] | range_m
none   | kind = "button"; range_m = [0, 1] | direction
none   | kind = "drawer"; direction = [0, 0, 0]; range_m = [0, 1] | direction
none   | kind = "button"; direction = [0, 0, 1]; range_m = [0.1, 1] | opening range
"#;

#[test]
fn mistakes_in_a_surface_are_named() {
    for mistake in MISTAKES.trim().lines() {
        let words: Vec<&str> = mistake.split(" | ").collect();
        let [kind, keys, named] = words[..] else {
            panic!("{mistake}");
        };
        let hinge = "kind = \"revolving_door\"; hinge_point_m = [0, 0, 0]; hinge_axis = [0, 0, 1]";
        let along = "direction = [1, 0, 0]; range_m = [0, 1]";
        let start = match kind.trim() {
            "none" => String::new(),
            "hinge" => hinge.to_owned(),
            "door" => format!("{hinge}; range_deg = [0, 90]"),
            "panel" => format!("kind = \"sliding_panel\"; {along}"),
            other => format!("kind = \"{other}\"; {along}"),
        };
        let sidecar = format!("[surface.wall]\n{start}\n{keys}").replace("; ", "\n");
        let error = Scene::from_obj_str(TRIANGLE, Some(&sidecar)).expect_err(&sidecar);
        let text = error.to_string();
        assert!(text.contains(named), "{mistake}: {text}");
        let malformed = matches!(error, SceneError::SidecarMalformed { .. });
        assert!(text.contains("wall") || malformed, "{text}");
    }
}

#[test]
fn the_sidecar_beside_a_file_is_found() {
    let files = Folder::new("beside");
    let obj = files.file("beside.obj", TRIANGLE);
    files.file("beside.toml", "default_kind = \"untouchable\"");
    let (scene, _) = Scene::from_obj_file(&obj, None).unwrap();
    assert_eq!(scene.surfaces()[0].kind, SurfaceKind::Untouchable);
    let other = files.file("other.toml", b"[surface.wall]\nroughness = 0.5");
    let (scene, _) = Scene::from_obj_file(&obj, Some(&other)).unwrap();
    let wall = &scene.surfaces()[0];
    assert_eq!(wall.kind, SurfaceKind::Static);
    assert_eq!(wall.roughness, Some(0.5));
    let missing = Scene::from_obj_file(&obj, Some(Path::new("gone.toml"))).unwrap_err();
    assert!(matches!(missing, SceneError::Io { .. }), "{missing}");
}

/// Regression: errors named the OBJ, or no file.
#[test]
fn errors_name_the_file_they_are_in() {
    let files = Folder::new("named");
    let obj = files.file("named.obj", TRIANGLE);
    for sidecar in [
        "[surface.wall]\nkind = \"swing\"",
        "[surface.door]\nkind = \"static\"",
        "[surface.wall]\nroughness = -1",
        "\u{0}",
    ] {
        files.file("named.toml", sidecar);
        let said = Scene::from_obj_file(&obj, None).unwrap_err().to_string();
        assert!(said.contains("named.toml"), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
    let bad = files.file("bad_scene.obj", b"v 0 0\n");
    let said = Scene::from_obj_file(&bad, None).unwrap_err().to_string();
    assert!(said.contains("bad_scene.obj"), "{said}");
    assert!(said.contains("line 1"), "{said}");
    let binary = files.file("not_text.toml", [0xff]);
    let said = Scene::from_obj_file(&obj, Some(&binary)).unwrap_err();
    assert!(said.to_string().contains("not_text.toml"), "{said}");
}
