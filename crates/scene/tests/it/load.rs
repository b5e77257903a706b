//! Loading of meshes and OBJ files: clean, repairable and invalid ones.

use crate::common::folder::Folder;
use crate::common::plain_surface;
use glam::DVec3;
use hwall_scene::{FileFrame, LoadLimits, LoadReport, Scene, SceneError, SurfaceId, SurfaceKind};
use std::io::ErrorKind;
use std::path::Path;

const TRIANGLE: &str = "o wall\nv 1 0 0\nv 1 1 0\nv 1 0 1\nf 1 2 3\n";

fn load(obj: &str) -> Result<(Scene, LoadReport), SceneError> {
    Scene::from_obj_str(obj, None)
}

fn error(obj: &str) -> SceneError {
    load(obj).expect_err(obj)
}

fn in_file(file: &Path, error: SceneError) -> SceneError {
    SceneError::File {
        path: file.display().to_string(),
        error: Box::new(error),
    }
}

#[test]
fn bad_numbers_and_indices_are_named_with_their_line() {
    for (value, text) in [
        (f64::INFINITY, "inf"),
        (f64::NEG_INFINITY, "-1e999"),
        (2e9, "2e9"),
    ] {
        let expected = SceneError::ObjVertex { line: 2, value };
        assert_eq!(error(&format!("v 0 0 0\nv 1 {text} 0\n")), expected);
    }
    for bad in [
        "v 1 2",
        "v 1 2 x",
        "v",
        "v 0 nan 0",
        "v 1 2 3 0",
        "v 1 2 3 4 5",
        "v 1,0 2 3",
        "v 1 2 3 nan",
    ] {
        let e = error(&format!("# comment\n{bad}\n"));
        let expected = match e {
            SceneError::ObjLine { line, keyword } => (line, keyword) == (2, "v"),
            SceneError::ObjVertex { line, .. } => line == 2,
            _ => false,
        };
        assert!(expected, "{bad}: {e}");
    }
    let out_of_range = |line, index, vertices| SceneError::ObjIndex {
        line,
        index,
        vertices,
    };
    for index in [0, 4, -4, i64::MAX, i64::MIN] {
        let e = error(&format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {index}\n"));
        assert_eq!(e, out_of_range(4, index, 3));
    }
    for bad in [
        "f a b c",
        "f 1 2 99999999999999999999",
        "f 1 2 //3",
        "f 1.5 2 3",
    ] {
        let said = error(&format!("v 0 0 0\nv 1 0 0\n{bad}\n")).to_string();
        assert_eq!(said, "OBJ line 3: malformed \"f\"", "{bad}");
    }
    // Indices refer to vertices above the face.
    assert_eq!(error("f 1 2 3\nv 0 0 0\n"), out_of_range(1, 1, 0));
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
    let files = Folder::new("binary");
    let binary = files.file("binary.obj", [0x7f, b'E', b'L', b'F', 0xff, 0xfe, 0]);
    let no_text = Scene::from_obj_file(&binary, None).unwrap_err();
    let expected = in_file(&binary, SceneError::NotText { offset: 6 });
    assert_eq!(no_text, expected);
    let missing = Scene::from_obj_file("no/such/file.obj", None).unwrap_err();
    let SceneError::Io { path, kind, .. } = &missing else {
        panic!("{missing}");
    };
    assert_eq!(path, "no/such/file.obj");
    assert_eq!(*kind, ErrorKind::NotFound);
    let folder = Scene::from_obj_file(env!("CARGO_MANIFEST_DIR"), None).unwrap_err();
    assert!(matches!(folder, SceneError::Io { .. }), "{folder}");
    let nothing = Scene::from_meshes(Vec::new()).unwrap_err();
    assert_eq!(nothing, SceneError::NoFaces);
}

#[test]
fn limits_hold() {
    let bytes = LoadLimits {
        max_bytes: 20,
        ..LoadLimits::default()
    };
    let one = LoadLimits {
        max_triangles: 1,
        ..LoadLimits::default()
    };
    let quad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    let files = Folder::new("limits");
    for (text, limits, refused) in [
        (TRIANGLE, bytes, Some(("bytes", 21, 20))),
        (TRIANGLE, one, None),
        (quad, one, Some(("triangles", 2, 1))),
    ] {
        let file = files.file("limits.obj", text);
        let read = Scene::from_obj_file_in(&file, None, &FileFrame::default(), &limits);
        let refused = refused
            .map(|(what, got, limit)| in_file(&file, SceneError::TooLarge { what, got, limit }));
        assert_eq!(read.err(), refused);
    }
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
        f 1 5 2 3 4
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
        duplicate_faces: 1,
        concave_polygons: 0,
        points_and_lines: 3,
        ignored_lines: 1,
        thinned_surfaces: ["wall", "nothing"].map(str::to_owned).to_vec(),
        empty_surfaces: vec![],
        missing_material_libraries: vec!["gone.mtl".to_owned()],
        missing_materials: vec!["brick".to_owned()],
    };
    assert_eq!(report, expected);
    assert!(!report.is_clean());
    assert_eq!(scene.surfaces().len(), 3);
    let (_, report) = load("o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no b\nf 1 1 2\n").unwrap();
    assert_eq!(report.empty_surfaces, ["b"]);
}

#[test]
fn groups_are_surfaces_whatever_happens_in_between() {
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\ng north wall\nf 1 2 4\ng roof\nf 2 3 4\ng north wall\nf 1 3 4";
    let (scene, _) = load(obj).unwrap();
    let names: Vec<_> = scene.surfaces().iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, [hwall_scene::UNNAMED, "north wall", "roof"]);
    let wall = scene.find("north wall").unwrap();
    assert_eq!(scene.triangles_m(wall).unwrap().len(), 2);
    assert_eq!(scene.find("south wall"), None);
}

#[test]
fn colours_come_from_the_library_and_a_bad_library_is_reported() {
    let files = Folder::new("colours");
    let obj = format!("mtllib red.mtl\nusemtl red\n{TRIANGLE}");
    let file = files.file("colour.obj", obj);
    let read = |library: &str| {
        files.file("red.mtl", library);
        Scene::from_obj_file(&file, None).unwrap()
    };
    let (scene, report) = read("newmtl red\nKd 0.8 0.1 0.2\n");
    assert!(report.is_clean(), "{report:?}");
    assert_eq!(scene.surfaces()[0].color_rgb, Some([0.8, 0.1, 0.2]));
    assert_eq!(scene.surfaces()[0].material.as_deref(), Some("red"));
    for bad in [
        "newmtl red\nKd 0.8 0.1\n",
        "newmtl red\nKd a b c\n",
        "newmtl red\nKd 1 nan 0\n",
        "newmtl\n",
    ] {
        let (scene, report) = read(bad);
        assert_eq!(report.missing_material_libraries.len(), 1, "{bad}");
        assert_eq!(report.missing_materials.len(), 1, "{bad}");
        assert_eq!(scene.surfaces()[0].color_rgb, None);
        assert_eq!(scene.surfaces()[0].material.as_deref(), Some("red"));
    }
}

/// Regression: all names of a statement were read as one.
#[test]
fn one_statement_names_several_libraries() {
    let files = Folder::new("several");
    files.file("one red.mtl", "newmtl red\nKd 1 0 0\n");
    files.file("one blue.MTL", b"# \xe9\nnewmtl blue\nKd 0 0 1\n");
    files.file("green.mtl", "newmtl green\nKd 0 1 0\n");
    files.file("one a.mtl b.mtl", "newmtl grey\nKd 1 1 1\n");
    let face = |(x, m): (usize, &str)| {
        format!("o {m}\nusemtl {m}\nv {x} 0 0\nv {x} 1 0\nv {x} 0 1\nf -3 -2 -1\n")
    };
    let faces: String = (["red", "blue", "green", "grey"].into_iter().enumerate())
        .map(face)
        .collect();
    let libraries =
        "mtllib one red.mtl gone.mtl one blue.MTL\nmtllib green.mtl\nmtllib one a.mtl b.mtl\n";
    let file = files.file("several.obj", libraries.to_owned() + &faces);
    let (scene, report) = Scene::from_obj_file(&file, None).unwrap();
    assert_eq!(report.missing_material_libraries, ["gone.mtl"]);
    assert!(report.missing_materials.is_empty(), "{report:?}");
    let colours: Vec<_> = scene.surfaces().iter().map(|s| s.color_rgb).collect();
    let [r, g, b] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(colours, [r, b, g, [1.0; 3]].map(Some));
}

#[test]
fn units_and_axes_of_a_file_become_metres_and_z_up() {
    let sidecar = "[surface.wall]\nkind = \"revolving_door\"\nhinge_point_m = [1, 2, 3]\nhinge_axis = [0, 1, 0]\nrange_deg = [0, 90]\n";
    let frame = FileFrame {
        metres_per_unit: 0.01,
        y_up: true,
    };
    let obj = TRIANGLE.replace(" 1", " 100");
    let obj = obj.replace("f 100", "f 1");
    let (scene, _) = Scene::from_obj_str_in(&obj, Some(sidecar), &frame).unwrap();
    let corners: Vec<_> = scene.triangles_m(SurfaceId(0)).unwrap().collect();
    assert_eq!(corners, [[[0, -1, 0], [0, -1, 1], [-1, -1, 0]].map(point)]);
    let SurfaceKind::RevolvingDoor {
        hinge_point_m,
        hinge_axis,
        ..
    } = scene.surfaces()[0].kind
    else {
        panic!("a door");
    };
    // Metres, along the axes of the file.
    assert_eq!(hinge_point_m, point([-3, -1, 2]));
    assert_eq!(hinge_axis, DVec3::Z);
    for metres_per_unit in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let frame = FileFrame {
            metres_per_unit,
            ..frame
        };
        let refused = Scene::from_obj_str_in(TRIANGLE, None, &frame);
        assert!(matches!(refused, Err(SceneError::Argument(_))));
    }
}

fn point(p: [i32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// A group keeps the first material of its faces; a material stays active beyond its group.
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
    let eye = DVec3::new(10_001.0, 5000.25, 0.25);
    let hit = scene.ray_cast(eye, DVec3::NEG_X).unwrap().unwrap();
    assert!((hit.point_m.x - 10_000.000_1).abs() < 1e-11, "{hit:?}");
}

/// Regression: the tree builder recursed 5,000 levels deep.
#[test]
fn thousands_of_identical_triangles() {
    let t = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let (scene, report) = Scene::from_meshes(vec![plain_surface("pile", vec![t; 5000])]).unwrap();
    assert_eq!((report.duplicate_faces, scene.triangle_count()), (4999, 1));
    let above = DVec3::new(0.2, 0.2, 1.0);
    let hit = scene.ray_cast(above, DVec3::NEG_Z).unwrap().unwrap();
    assert_eq!(hit.distance_m, 1.0);
}

/// No two are identical, but all their boxes are equal in single precision.
#[test]
fn thousands_of_coinciding_boxes() {
    let n = 20_000;
    let pile = |i: i32| {
        let x = f64::from(i) * 1e-13;
        [DVec3::ZERO, DVec3::X, DVec3::Y].map(|corner| corner + x * DVec3::X)
    };
    let pile = plain_surface("pile", (0..n).map(pile).collect());
    let (scene, report) = Scene::from_meshes(vec![pile]).unwrap();
    assert!(report.is_clean() && scene.triangle_count() == n as usize);
    for x in [0.1, 0.5] {
        let above = DVec3::new(x, 0.2, 0.5);
        assert!(scene.ray_cast(above, DVec3::NEG_Z).unwrap().is_some());
        let closest = scene.closest_point(above, 1.0).unwrap().unwrap();
        assert_eq!(closest.distance_m, 0.5);
    }
}

/// One stray vertex collapses the rest of the scene to a point in single precision.
#[test]
fn detail_far_below_single_precision_stays_closest_exactly() {
    let small = |i: i32| {
        let at = DVec3::new(f64::from(i % 40), f64::from(i / 40), 0.0) * 1e-3;
        [at, at + DVec3::X * 1e-3, at + DVec3::Y * 1e-3]
    };
    let far = [DVec3::ONE, DVec3::X, DVec3::Y].map(|corner| corner * 9e8);
    let meshes = vec![
        plain_surface("detail", (0..1600).map(small).collect()),
        plain_surface("far", vec![far]),
    ];
    let (scene, _) = Scene::from_meshes(meshes).unwrap();
    let detail = scene.find("detail").unwrap();
    let above = DVec3::new(0.0202, 0.0202, 0.5);
    let closest = scene.project_on(detail, above).unwrap();
    assert!((closest.distance_m - 0.5).abs() < 1e-6, "{closest:?}");
    let near = scene.closest_point(above, 1.0).unwrap().unwrap();
    assert_eq!(near.surface, detail);
}

#[test]
fn meshes_in_memory_are_checked_too() {
    let t = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let nan = [DVec3::ZERO, DVec3::new(f64::NAN, 0.0, 0.0), DVec3::Y];
    let e = Scene::from_meshes(vec![plain_surface("a", vec![t, nan])]).unwrap_err();
    let is_nan = matches!(&e, SceneError::Parameter { value, .. } if value.is_nan());
    assert!(is_nan, "{e}");
    let twice = [(); 2].map(|()| plain_surface("a", vec![t]));
    let e = Scene::from_meshes(twice.into()).unwrap_err();
    let name = "a".to_owned();
    assert_eq!(e, SceneError::DuplicateSurface { name });
}

/// The area of all triangles of a scene, m².
fn area_m2(scene: &Scene) -> f64 {
    let ids = (0..scene.surfaces().len()).map(SurfaceId);
    let all = ids.flat_map(|id| scene.triangles_m(id).unwrap());
    all.map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length())
        .sum()
}

#[test]
fn concave_polygons_are_cut_without_overlap_from_any_corner() {
    let l_shape = [[1, 2], [-1, 2], [-1, 0], [0, 0], [0, 1], [1, 1]];
    // A wall of 2 by 2.5 m with a doorway of 0.8 by 2 m.
    let door_y = [-10, -4, -4, 4, 4, 10, 10, -10];
    let door_z = [0, 0, 20, 20, 0, 0, 25, 25];
    let door: [[i32; 2]; 8] = std::array::from_fn(|i| [door_y[i], door_z[i]]);
    // A window in a wall, with a bridge to it.
    let window_y = [0, 4, 4, 0, 0, 1, 1, 3, 3, 1];
    let window_z = [0, 0, 4, 4, 0, 1, 3, 3, 1, 1];
    let window: [[i32; 2]; 10] = std::array::from_fn(|i| [window_y[i], window_z[i]]);
    for (corners, scale, expected_m2) in [
        (&l_shape[..], 1.0, 3.0),
        (&door[..], 0.1, 5.0 - 1.6),
        (&window[..], 1.0, 16.0 - 4.0),
    ] {
        let count = corners.len();
        for first in 0..count {
            for turned in [false, true] {
                let mut obj = "o wall\n".to_owned();
                for k in 0..count {
                    let k = if turned { count - 1 - k } else { k };
                    let [y, z] = corners[(first + k) % count].map(|m| scale * f64::from(m));
                    obj += &format!("v 0.6 {y} {z}\n");
                }
                let face: Vec<String> = (1..=count).map(|k| k.to_string()).collect();
                obj += &format!("f {}\n", face.join(" "));
                let (scene, report) = load(&obj).unwrap();
                let off_m2 = area_m2(&scene) - expected_m2;
                assert!(off_m2.abs() < 1e-9, "{first} {turned}");
                assert_eq!(report.concave_polygons, 0);
            }
        }
    }
    // Through the doorway, and beside it.
    let corners =
        door.map(|[y, z]| format!("v 0.6 {} {}\n", 0.1 * f64::from(y), 0.1 * f64::from(z)));
    let obj = format!("o wall\n{}f 1 2 3 4 5 6 7 8\n", corners.concat());
    let (scene, _) = load(&obj).unwrap();
    let hit = |y: f64, z: f64| scene.ray_cast(DVec3::new(0.0, y, z), DVec3::X).unwrap();
    assert!(hit(0.25, 0.3).is_none() && hit(-0.39, 1.9).is_none());
    assert!(hit(0.41, 0.3).is_some() && hit(0.0, 2.1).is_some());
}

#[test]
fn what_windows_and_scanners_write_is_read() {
    let wall = "o wall\nv 0.5 -1 0\nv 0.5 1 0\nv 0.5 1 1\nv 0.5 -1 1\nf 1 2 3 4\n";
    let named = |text: &str| {
        let (scene, report) = load(text).unwrap();
        assert!(report.is_clean(), "{report:?}");
        assert!((area_m2(&scene) - 2.0).abs() < 1e-9);
        scene.surfaces()[0].name.clone()
    };
    for text in [
        format!("\u{feff}{wall}"),
        wall.replace('\n', "\r"),
        wall.replace('\n', "\r\n"),
        wall.replace("1 1\n", "1 1 0.2 0.3 0.4 1\n"),
    ] {
        assert_eq!(named(&text), "wall");
    }
    let files = Folder::new("latin");
    let latin = files.file("latin.obj", [b"# Geb\xe4ude\n", wall.as_bytes()].concat());
    let (scene, _) = Scene::from_obj_file(&latin, None).unwrap();
    assert_eq!(scene.surfaces()[0].name, "wall");
}
