//! What becomes of files: clean ones, repairable ones and bad ones.

use glam::DVec3;
use hwall_scene::{
    LoadLimits, LoadReport, Mechanics, Scene, SceneError, Surface, SurfaceClick, SurfaceDetent,
    SurfaceKind, SurfaceMesh,
};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

const TRIANGLE: &str = "o wall\nv 1 0 0\nv 1 1 0\nv 1 0 1\nf 1 2 3\n";

fn load(obj: &str) -> Result<(Scene, LoadReport), SceneError> {
    Scene::from_obj_str(obj, None)
}

fn error(obj: &str) -> SceneError {
    load(obj).expect_err(obj)
}

/// A file of its own for this test, removed at its end.
struct TempFile(PathBuf);

impl TempFile {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let path = std::env::temp_dir().join(format!("hwall-scene-{}-{name}", std::process::id()));
        std::fs::write(&path, bytes).unwrap();
        Self(path)
    }
}

impl Drop for TempFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

#[test]
fn bad_numbers_and_indices_are_named_with_their_line() {
    for (value, text) in [
        (f64::INFINITY, "inf"),
        (f64::NEG_INFINITY, "-1e999"),
        (2e9, "2e9"),
    ] {
        assert_eq!(
            error(&format!("v 0 0 0\nv 1 {text} 0\n")),
            SceneError::ObjVertex { line: 2, value }
        );
    }
    let nan = error("v 0 nan 0\n");
    assert!(
        matches!(nan, SceneError::ObjVertex { line: 1, value } if value.is_nan()),
        "{nan}"
    );
    for bad in [
        "v 1 2",
        "v 1 2 x",
        "v",
        "v 1 2 3 0",
        "v 1 2 3 4 5",
        "v 1,0 2 3",
        "v 1 2 3 nan",
    ] {
        let e = error(&format!("# comment\n{bad}\n"));
        assert!(
            matches!(
                e,
                SceneError::ObjLine {
                    line: 2,
                    keyword: "v"
                } | SceneError::ObjVertex { line: 2, .. }
            ),
            "{bad}: {e}"
        );
    }
    for index in [0, 4, -4, i64::MAX, i64::MIN] {
        let e = error(&format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {index}\n"));
        assert_eq!(
            e,
            SceneError::ObjIndex {
                line: 4,
                index,
                vertices: 3
            }
        );
    }
    for bad in [
        "f a b c",
        "f 1 2 99999999999999999999",
        "f 1 2 //3",
        "f 1.5 2 3",
    ] {
        assert_eq!(
            error(&format!("v 0 0 0\nv 1 0 0\n{bad}\n")).to_string(),
            "OBJ line 3: malformed \"f\"",
            "{bad}"
        );
    }
    // Indices count what stands above the face.
    assert_eq!(
        error("f 1 2 3\nv 0 0 0\n"),
        SceneError::ObjIndex {
            line: 1,
            index: 1,
            vertices: 0
        }
    );
}

#[test]
fn what_holds_no_scene_is_an_error() {
    for empty in [
        "",
        "# only a comment\n",
        "v 0 0 0\n",
        "o a\ng b\n",
        "PK\u{3}\u{4} junk\n\u{1}\u{2}",
    ] {
        assert_eq!(error(empty), SceneError::NoFaces, "{empty:?}");
    }
    let binary = TempFile::new("binary.obj", &[0x7f, b'E', b'L', b'F', 0xff, 0xfe, 0]);
    assert_eq!(
        Scene::from_obj_file(&binary.0, None).unwrap_err(),
        in_file(&binary, SceneError::NotText { offset: 4 })
    );
    let missing = Scene::from_obj_file("no/such/file.obj", None).unwrap_err();
    assert!(
        matches!(&missing, SceneError::Io { path, kind, .. }
            if path == "no/such/file.obj" && *kind == ErrorKind::NotFound),
        "{missing}"
    );
    let folder = Scene::from_obj_file(env!("CARGO_MANIFEST_DIR"), None).unwrap_err();
    assert!(matches!(folder, SceneError::Io { .. }), "{folder}");
    assert_eq!(
        Scene::from_meshes(Vec::new()).unwrap_err(),
        SceneError::NoFaces
    );
}

#[test]
fn limits_hold() {
    let file = TempFile::new("limits.obj", TRIANGLE.as_bytes());
    let limits = LoadLimits {
        max_bytes: 20,
        ..LoadLimits::default()
    };
    let e = Scene::from_obj_file_within(&file.0, None, &limits).unwrap_err();
    assert_eq!(
        e,
        in_file(
            &file,
            SceneError::TooLarge {
                what: "bytes",
                got: 21,
                limit: 20
            }
        )
    );
    let limits = LoadLimits {
        max_triangles: 1,
        ..LoadLimits::default()
    };
    assert!(Scene::from_obj_file_within(&file.0, None, &limits).is_ok());
    let quad = TempFile::new(
        "quad.obj",
        b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n",
    );
    let e = Scene::from_obj_file_within(&quad.0, None, &limits).unwrap_err();
    assert_eq!(
        e,
        in_file(
            &quad,
            SceneError::TooLarge {
                what: "triangles",
                got: 2,
                limit: 1
            }
        )
    );
}

#[test]
fn repairs_are_listed() {
    let obj = "
        o wall
        v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.1 0\nv 2 0 0
        vt 0 0\nvn 0 0 1
        f 1/1/1 2/1/1 3/1/1
        f 2//1 3//1 1//1        # the same again
        f -4 -3 -6              # a new one, counted backwards
        f 1 2 6                 # no area
        f 1 1 2
        f 1 2                   # a line
        l 1 2\np 3
        o dart
        f 1 5 2 3 4             # its fan repeats two faces of the wall
        o nothing
        f 1 2 6
        mtllib gone.mtl
        usemtl brick
        surf 1 2 3
        f 1 \\
          2 \\
          4";
    let (scene, report) = load(obj).unwrap();
    let expected = LoadReport {
        degenerate_faces: 3,
        duplicate_faces: 3,
        concave_polygons: 1,
        points_and_lines: 3,
        ignored_lines: 1,
        empty_surfaces: vec![],
        missing_material_libraries: vec!["gone.mtl".to_owned()],
        missing_materials: vec!["brick".to_owned()],
    };
    assert_eq!(report, expected);
    assert!(!report.is_clean());
    assert_eq!(scene.surfaces().len(), 3);
    assert_eq!(
        load("o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no b\nf 1 1 2\n")
            .unwrap()
            .1
            .empty_surfaces,
        ["b"]
    );
}

#[test]
fn groups_are_surfaces_whatever_happens_in_between() {
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\ng north wall\nf 1 2 4\ng roof\nf 2 3 4\ng north wall\nf 1 3 4";
    let (scene, _) = load(obj).unwrap();
    let names: Vec<_> = scene.surfaces().iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, [hwall_scene::UNNAMED, "north wall", "roof"]);
    assert_eq!(
        scene
            .triangles_m(scene.find("north wall").unwrap())
            .unwrap()
            .len(),
        2
    );
    assert_eq!(scene.find("south wall"), None);
}

#[test]
fn colours_come_from_the_library_and_a_bad_library_is_reported() {
    let obj = |library: &TempFile| {
        let name = library.0.file_name().unwrap().to_str().unwrap().to_owned();
        format!("mtllib {name}\nusemtl red\n{TRIANGLE}")
    };
    let good = TempFile::new("good.mtl", b"newmtl red\nKd 0.8 0.1 0.2\n");
    let file = TempFile::new("colour.obj", obj(&good).as_bytes());
    let (scene, report) = Scene::from_obj_file(&file.0, None).unwrap();
    assert!(report.is_clean(), "{report:?}");
    assert_eq!(scene.surfaces()[0].color_rgb, Some([0.8, 0.1, 0.2]));
    assert_eq!(scene.surfaces()[0].material.as_deref(), Some("red"));
    for bad in [
        "newmtl red\nKd 0.8 0.1\n",
        "newmtl red\nKd a b c\n",
        "newmtl red\nKd 1 nan 0\n",
        "newmtl\n",
    ] {
        let library = TempFile::new("bad.mtl", bad.as_bytes());
        let file = TempFile::new("bad.obj", obj(&library).as_bytes());
        let (scene, report) = Scene::from_obj_file(&file.0, None).unwrap();
        assert_eq!(
            (
                report.missing_material_libraries.len(),
                report.missing_materials.len()
            ),
            (1, 1),
            "{bad}"
        );
        assert_eq!(scene.surfaces()[0].color_rgb, None);
        assert_eq!(scene.surfaces()[0].material.as_deref(), Some("red"));
    }
}

/// A group keeps the first material of its faces; a material outlives its group.
#[test]
fn materials_are_kept_by_name_without_a_library() {
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3
        o bare\nf 1 2 4
        usemtl old oak
        o door\nf 2 3 4
        usemtl brass
        f 1 3 4
        o handle\nf 1 2 5";
    let (scene, report) = load(obj).unwrap();
    let material = |name: &str| {
        let id = scene.find(name).unwrap();
        scene.surface(id).material.as_deref()
    };
    assert_eq!(material(hwall_scene::UNNAMED), None);
    assert_eq!(material("door"), Some("old oak"));
    assert_eq!(material("handle"), Some("brass"));
    assert_eq!(report.missing_materials, ["old oak", "brass"]);
}

/// `tobj` alone would round these to a millimetre.
#[test]
fn a_file_ten_kilometres_off_keeps_its_digits() {
    let obj = "v 10000.0001 5000 0\nv 10000.0001 5001 0\nv 10000.0001 5000 1\nf 1 2 3";
    let (scene, _) = load(obj).unwrap();
    let hit = scene
        .ray_cast(DVec3::new(10_001.0, 5000.25, 0.25), DVec3::NEG_X)
        .unwrap()
        .unwrap();
    assert!(
        (hit.point_m.x - 10_000.000_1).abs() < 1e-11,
        "{}",
        hit.point_m.x
    );
}

#[test]
fn sidecar_mistakes_are_named() {
    let with = |sidecar: &str| Scene::from_obj_str(TRIANGLE, Some(sidecar)).expect_err(sidecar);
    let unknown = with("[surface.door]\nkind = \"static\"");
    assert_eq!(
        unknown,
        SceneError::SidecarUnknownSurface {
            name: "door".to_owned()
        }
    );
    for (text, named) in [
        ("[surface.wall]\ncolour = 3", "colour"),
        ("[surface.wall]\nkind = \"swing\"", "swing"),
        ("kinds = 1", "kinds"),
        ("default_kind = \"revolving_door\"", "default_kind"),
        ("[surface.wall", "wall"),
        ("[surface.wall]\nroughness = \"rough\"", "rough"),
    ] {
        let e = with(text);
        assert!(
            matches!(&e, SceneError::SidecarMalformed { message } if message.contains(named)),
            "{e}"
        );
    }
    let door = "[surface.wall]\nkind = \"revolving_door\"\n";
    let missing = with(&format!(
        "{door}hinge_point_m = [0, 0, 0]\nrange_deg = [0, 1]"
    ));
    assert!(
        matches!(
            missing,
            SceneError::SidecarMissingKey {
                key: "hinge_axis",
                ..
            }
        ),
        "{missing}"
    );
    let stray = with("[surface.wall]\nrange_deg = [0, 90]");
    assert!(
        matches!(
            stray,
            SceneError::SidecarStrayKey {
                key: "range_deg",
                kind: "static",
                ..
            }
        ),
        "{stray}"
    );
    let stray = with(&format!("{door}direction = [0, 0, 1]"));
    assert!(
        matches!(
            stray,
            SceneError::SidecarStrayKey {
                key: "direction",
                ..
            }
        ),
        "{stray}"
    );
    let hinge = "hinge_point_m = [0, 0, 0]\nhinge_axis = [0, 0, 2]\n";
    for (keys, what) in [
        ("range_deg = [10, 90]", "opening range"),
        ("range_deg = [90, 0]", "opening range"),
        ("range_deg = [0, nan]", "opening range"),
        ("range_deg = [0, 720]", "opening range"),
        ("range_deg = [0, 90]\nroughness = -1", "roughness"),
        (
            "range_deg = [0, 90]\ndamping_n_m_s_per_rad = inf",
            "damping_n_m_s_per_rad",
        ),
    ] {
        let e = with(&format!("{door}{hinge}{keys}"));
        assert!(
            matches!(&e, SceneError::Parameter { what: w, .. } if *w == what),
            "{keys}: {e}"
        );
    }
    let no_axis = with(&format!(
        "{door}hinge_point_m = [0, 0, 0]\nhinge_axis = [0, 0, 0]\nrange_deg = [0, 9]"
    ));
    assert!(
        matches!(
            no_axis,
            SceneError::Parameter {
                what: "hinge_axis",
                ..
            }
        ),
        "{no_axis}"
    );
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
    let kind = read(&format!(
        "[surface.wall]\nkind = \"button\"\n{sliding}\n{click}"
    ));
    let click = SurfaceClick {
        start: 0.001,
        snap: 0.003,
        release: 0.001,
        force: 4.0,
    };
    assert_eq!(kind.mechanics().unwrap().click, Some(click));
    // Files from before say nothing of it.
    let kind =
        read("[surface.wall]\nkind = \"sliding_panel\"\ndirection = [0, 2, 0]\nrange_m = [0, 1]");
    assert_eq!(kind.mechanics(), Some(&Mechanics::default()));
    assert_eq!(SurfaceKind::Static.mechanics(), None);
}

#[test]
fn mistakes_in_mechanics_are_named() {
    let door = "kind = \"revolving_door\"\nhinge_point_m = [0, 0, 0]\nhinge_axis = [0, 0, 1]\nrange_deg = [0, 90]";
    let [panel, drawer, button] = ["sliding_panel", "drawer", "button"]
        .map(|kind| format!("kind = {kind:?}\ndirection = [1, 0, 0]\nrange_m = [0, 1]"));
    let (panel, drawer, button) = (panel.as_str(), drawer.as_str(), button.as_str());
    for (kind, keys, named) in [
        (door, "inertia_kg_m2 = 0", "inertia_kg_m2"),
        (door, "inertia_kg_m2 = nan", "inertia_kg_m2"),
        (door, "friction_n_m = -1", "friction_n_m"),
        (door, "rest_deg = inf", "rest_deg"),
        (door, "restitution = 1.5", "restitution"),
        (door, "mass_kg = 1", "mass_kg"),
        (door, "friction_n = 1", "friction_n"),
        (
            door,
            "click = { start_m = 0, snap_m = 1, force_n = 1 }",
            "click",
        ),
        (
            door,
            "detents = [{ position_deg = 0, torque_n_m = 1 }]",
            "detents.half_width_deg",
        ),
        (
            door,
            "detents = [{ position_deg = 0, half_width_deg = 0, torque_n_m = 1 }]",
            "detents.half_width_deg",
        ),
        (door, "detents = [{ position_m = 0 }]", "detents.position_m"),
        (door, "detents = [{ depth = 0 }]", "depth"),
        (panel, "mass_kg = -1", "mass_kg"),
        (panel, "stiffness_n_per_m = nan", "stiffness_n_per_m"),
        (panel, "inertia_kg_m2 = 1", "inertia_kg_m2"),
        (
            panel,
            "click = { start_m = 0, snap_m = 1, force_n = 1 }",
            "click",
        ),
        (drawer, "hinge_axis = [0, 0, 1]", "hinge_axis"),
        (drawer, "friction_n = inf", "friction_n"),
        (
            drawer,
            "detents = [{ position_m = 0, half_width_m = 1, force_n = -1 }]",
            "detents.force_n",
        ),
        (
            drawer,
            "detents = [{ position_m = 0, half_width_m = 1, torque_n_m = 1 }]",
            "detents.torque_n_m",
        ),
        (
            button,
            "click = { start_m = 0.1, snap_m = 0.1, force_n = 1 }",
            "click.snap_m",
        ),
        (
            button,
            "click = { start_m = 0, snap_m = 1, release_m = 2, force_n = 1 }",
            "click.release_m",
        ),
        (
            button,
            "click = { start_m = nan, snap_m = 1, force_n = 1 }",
            "click.start_m",
        ),
        (
            button,
            "click = { start_m = 0, snap_m = 1, force_n = -1 }",
            "click.force_n",
        ),
        (button, "click = { start_m = 0, force_n = 1 }", "snap_m"),
        (
            button,
            "click = { start_m = 0, snap_m = 1, force_n = 1, noise = 2 }",
            "noise",
        ),
        ("kind = \"static\"", "restitution = 1", "restitution"),
        ("kind = \"static\"", "mass_kg = 1", "mass_kg"),
        ("kind = \"untouchable\"", "detents = []", "detents"),
        ("kind = \"drawer\"", "direction = [1, 0, 0]", "range_m"),
        ("kind = \"button\"", "range_m = [0, 1]", "direction"),
        (
            "kind = \"drawer\"",
            "direction = [0, 0, 0]\nrange_m = [0, 1]",
            "direction",
        ),
        (
            "kind = \"button\"",
            "direction = [0, 0, 1]\nrange_m = [0.1, 1]",
            "opening range",
        ),
    ] {
        let sidecar = format!("[surface.wall]\n{kind}\n{keys}");
        let error = Scene::from_obj_str(TRIANGLE, Some(&sidecar)).expect_err(&sidecar);
        assert!(error.to_string().contains(named), "{keys}: {error}");
        assert!(
            error.to_string().contains("wall")
                || matches!(error, SceneError::SidecarMalformed { .. }),
            "{error}"
        );
    }
}

#[test]
fn the_sidecar_beside_a_file_is_found() {
    let obj = TempFile::new("beside.obj", TRIANGLE.as_bytes());
    let toml = TempFile::new("beside.toml", b"default_kind = \"untouchable\"");
    assert_eq!(toml.0, obj.0.with_extension("toml"));
    let (scene, _) = Scene::from_obj_file(&obj.0, None).unwrap();
    assert_eq!(scene.surfaces()[0].kind, SurfaceKind::Untouchable);
    let other = TempFile::new("other.toml", b"[surface.wall]\nroughness = 0.5");
    let (scene, _) = Scene::from_obj_file(&obj.0, Some(&other.0)).unwrap();
    assert_eq!(
        (&scene.surfaces()[0].kind, scene.surfaces()[0].roughness),
        (&SurfaceKind::Static, Some(0.5))
    );
    let missing = Scene::from_obj_file(&obj.0, Some(Path::new("gone.toml"))).unwrap_err();
    assert!(matches!(missing, SceneError::Io { .. }), "{missing}");
}

/// They named the OBJ, or no file.
#[test]
fn errors_name_the_file_they_are_in() {
    let obj = TempFile::new("named.obj", TRIANGLE.as_bytes());
    for sidecar in [
        "[surface.wall]\nkind = \"swing\"",
        "[surface.door]\nkind = \"static\"",
        "[surface.wall]\nroughness = -1",
        "\u{0}",
    ] {
        let toml = TempFile::new("named.toml", sidecar.as_bytes());
        let said = Scene::from_obj_file(&obj.0, None).unwrap_err().to_string();
        assert!(said.contains("named.toml"), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        drop(toml);
    }
    let bad = TempFile::new("bad.obj", b"v 0 0\n");
    let said = Scene::from_obj_file(&bad.0, None).unwrap_err().to_string();
    assert!(
        said.contains("bad.obj") && said.contains("line 1"),
        "{said}"
    );
    let binary = TempFile::new("binary.toml", &[0xff]);
    let said = Scene::from_obj_file(&obj.0, Some(&binary.0)).unwrap_err();
    assert!(said.to_string().contains("binary.toml"), "{said}");
}

fn in_file(file: &TempFile, error: SceneError) -> SceneError {
    SceneError::File {
        path: file.0.display().to_string(),
        error: Box::new(error),
    }
}

fn surface(name: &str, triangles_m: Vec<[DVec3; 3]>) -> SurfaceMesh {
    SurfaceMesh {
        surface: Surface {
            name: name.to_owned(),
            ..Surface::default()
        },
        triangles_m,
    }
}

/// They made the tree builder of the hierarchy recurse 5,000 deep.
#[test]
fn thousands_of_identical_triangles() {
    let t = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let (scene, report) = Scene::from_meshes(vec![surface("pile", vec![t; 5000])]).unwrap();
    assert_eq!((report.duplicate_faces, scene.triangle_count()), (4999, 1));
    let hit = scene
        .ray_cast(DVec3::new(0.2, 0.2, 1.0), DVec3::NEG_Z)
        .unwrap()
        .unwrap();
    assert_eq!(hit.distance_m, 1.0);
}

/// No two are identical, but in single precision all their boxes are.
#[test]
fn thousands_of_coinciding_boxes() {
    let n = 20_000;
    let pile = |i: i32| {
        let x = f64::from(i) * 1e-13;
        [
            DVec3::new(x, 0.0, 0.0),
            DVec3::new(1.0 + x, 0.0, 0.0),
            DVec3::new(x, 1.0, 0.0),
        ]
    };
    let (scene, report) =
        Scene::from_meshes(vec![surface("pile", (0..n).map(pile).collect())]).unwrap();
    assert!(report.is_clean() && scene.triangle_count() == n as usize);
    for x in [0.1, 0.5] {
        assert!(
            scene
                .ray_cast(DVec3::new(x, 0.2, 1.0), DVec3::NEG_Z)
                .unwrap()
                .is_some()
        );
        let closest = scene
            .closest_point(DVec3::new(x, 0.2, 0.5), 1.0)
            .unwrap()
            .unwrap();
        assert_eq!(closest.distance_m, 0.5);
    }
}

/// One stray vertex makes the rest of the scene a single point for single precision.
#[test]
fn detail_far_below_single_precision_stays_closest_exactly() {
    let small = |i: i32| {
        let at = DVec3::new(f64::from(i % 40), f64::from(i / 40), 0.0) * 1e-3;
        [at, at + DVec3::X * 1e-3, at + DVec3::Y * 1e-3]
    };
    let far = [
        DVec3::splat(9e8),
        DVec3::new(9e8, 0.0, 0.0),
        DVec3::new(0.0, 9e8, 0.0),
    ];
    let meshes = vec![
        surface("detail", (0..1600).map(small).collect()),
        surface("far", vec![far]),
    ];
    let (scene, _) = Scene::from_meshes(meshes).unwrap();
    let detail = scene.find("detail").unwrap();
    let closest = scene
        .project_on(detail, DVec3::new(0.0202, 0.0202, 0.5))
        .unwrap();
    assert!((closest.distance_m - 0.5).abs() < 1e-6, "{closest:?}");
    let near = scene
        .closest_point(DVec3::new(0.0202, 0.0202, 0.5), 1.0)
        .unwrap()
        .unwrap();
    assert_eq!(near.surface, detail);
}

#[test]
fn meshes_in_memory_are_checked_too() {
    let t = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let nan = [DVec3::ZERO, DVec3::new(f64::NAN, 0.0, 0.0), DVec3::Y];
    let e = Scene::from_meshes(vec![surface("a", vec![t, nan])]).unwrap_err();
    assert!(
        matches!(&e, SceneError::Parameter { value, .. } if value.is_nan()),
        "{e}"
    );
    let e = Scene::from_meshes(vec![surface("a", vec![t]), surface("a", vec![t])]).unwrap_err();
    assert_eq!(
        e,
        SceneError::DuplicateSurface {
            name: "a".to_owned()
        }
    );
}
