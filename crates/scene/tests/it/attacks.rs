//! Attacks on the readers that got through once.

use glam::DVec3;
use hwall_scene::Scene;
use std::fmt::Write as _;
use std::path::PathBuf;

/// A folder of its own for a test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let name = format!("hwall_scene_{}_{name}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, text).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const FACE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const RED: &str = "newmtl red\nKd 1 0 0\n";

/// A polygon of n corners took time in proportion to n squared: 40,000 corners, 41 s. Tests run for minutes with that.
#[test]
fn one_polygon_of_many_corners() {
    let n = 60_000;
    let mut obj = String::new();
    for i in 0..n {
        let (y, x) = (std::f64::consts::TAU * f64::from(i) / f64::from(n)).sin_cos();
        let _ = writeln!(obj, "v {x} {y} 0");
    }
    obj.push('f');
    for i in 1..=n {
        let _ = write!(obj, " {i}");
    }
    let (scene, report) = Scene::from_obj_str(&obj, None).unwrap();
    assert_eq!(
        scene.triangle_count() + report.degenerate_faces,
        n as usize - 2
    );
}

/// So did materials of different names: 240,000 took more than 120 s.
#[test]
fn many_materials() {
    let n = 240_000;
    let mut obj = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    for i in 0..n {
        let _ = writeln!(obj, "usemtl m{i}");
    }
    obj.push_str("f 1 2 3\n");
    let (_, report) = Scene::from_obj_str(&obj, None).unwrap();
    assert_eq!(report.missing_materials.len(), n);
}

#[test]
fn many_groups() {
    let mut obj = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n");
    for i in 0..100_000 {
        let _ = writeln!(obj, "g a{i}\nf 1 2 3\ng b\nf 1 2 4");
    }
    let (scene, report) = Scene::from_obj_str(&obj, None).unwrap();
    assert_eq!(scene.triangle_count() + report.duplicate_faces, 200_000);
}

/// `mtllib` followed `..` and absolute paths out of the folder of the OBJ.
#[test]
fn material_libraries_stay_in_the_folder() {
    let folder = Folder::new("outside");
    let outside = folder.file("outside.mtl", RED);
    let obj = |library: &str| {
        let text = format!("mtllib {library}\nusemtl red\n{FACE}");
        let path = folder.file("scene/room.obj", &text);
        Scene::from_obj_file(path, None).unwrap()
    };
    for library in [
        "../outside.mtl",
        outside.to_str().unwrap(),
        "a/../../outside.mtl",
        ".",
    ] {
        let (scene, report) = obj(library);
        assert_eq!(report.missing_material_libraries, [library]);
        assert_eq!(scene.surfaces()[0].color_rgb, None);
    }
    folder.file("scene/sub/inside.mtl", RED);
    for library in ["sub/inside.mtl", "./sub/inside.mtl"] {
        let (scene, report) = obj(library);
        assert!(report.is_clean());
        assert_eq!(scene.surfaces()[0].color_rgb, Some([1.0, 0.0, 0.0]));
    }
}

/// A library that is a pipe was waited for.
#[cfg(unix)]
#[test]
fn a_material_library_that_is_a_pipe_is_missing() {
    let folder = Folder::new("pipe");
    let made = std::process::Command::new("mkfifo")
        .arg(folder.0.join("p.mtl"))
        .status();
    if !made.is_ok_and(|status| status.success()) {
        return;
    }
    let path = folder.file("room.obj", &format!("mtllib p.mtl\n{FACE}"));
    let (_, report) = Scene::from_obj_file(path, None).unwrap();
    assert_eq!(report.missing_material_libraries, ["p.mtl"]);
}

/// A library was read once for every line that names it.
#[test]
fn a_material_library_is_read_once() {
    let folder = Folder::new("once");
    let mut library = String::from(RED);
    for i in 0..20_000 {
        let _ = writeln!(library, "newmtl m{i}\nKd 0 0 0");
    }
    folder.file("big.mtl", &library);
    let text = "mtllib big.mtl\n".repeat(20_000) + "usemtl red\n" + FACE;
    let path = folder.file("room.obj", &text);
    let (scene, _) = Scene::from_obj_file(path, None).unwrap();
    assert_eq!(scene.surfaces()[0].color_rgb, Some([1.0, 0.0, 0.0]));
}

/// One corner a million kilometres away: what was left of small faces after rounding gave NaN.
#[test]
fn a_sliver_beside_a_far_corner_gives_no_nan() {
    let far = "v 1e9 9e8 7e8\nv 9e8 1e9 7e8\nv 8e8 9e8 1e9\nf 1 2 3\n";
    for height in [
        1e-1, 1e-3, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-12, 1e-15, 1e-100,
    ] {
        let obj = format!(
            "{far}o small\nv 0.1 0.2 0.3\nv {} 0.2 0.3\nv 0.1 {} 0.3\nf 4 5 6\no long\nv 1.1 0.2 0.3\nv 0.5 {} 0.3\nf 4 7 8\n",
            0.1 + height,
            0.2 + height,
            0.2 + height
        );
        let (scene, report) = Scene::from_obj_str(&obj, None).unwrap();
        assert_eq!(scene.triangle_count() + report.degenerate_faces, 3);
        for p in [DVec3::ZERO, DVec3::new(0.3, 0.2, 1.0), DVec3::splat(1e9)] {
            for surface in scene.surfaces() {
                let id = scene.find(&surface.name).unwrap();
                let found = scene.project_on(id, p).unwrap();
                assert!(found.point_m.is_finite(), "{height:e} {found:?}");
                assert!(
                    (found.normal.length() - 1.0).abs() < 1e-9,
                    "{height:e} {found:?}"
                );
            }
            for d in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, 2.0, 3.0)] {
                if let Some(hit) = scene.ray_cast(p - d * 0.5, d).unwrap() {
                    assert!(hit.point_m.is_finite(), "{height:e} {hit:?}");
                    assert!(
                        (hit.normal.length() - 1.0).abs() < 1e-9,
                        "{height:e} {hit:?}"
                    );
                }
            }
        }
    }
}

/// Mechanics of 1e308 were accepted, and so was an axis so far away that where the door stands is rounding.
#[test]
fn doors_out_of_this_world_are_refused() {
    let here = "[0.0, 0.0, 0.0]";
    for (point, key, limit) in [
        (here, "inertia_kg_m2 = 1e308", "1e12"),
        (here, "friction_n_m = 1e200", "1e12"),
        (here, "roughness = 1e300", "1e12"),
        ("[1e20, 0.0, 0.0]", "", "1e9"),
        ("[0.0, 1e300, 0.0]", "", "1e9"),
        ("[0.0, 0.0, -1e10]", "", "1e9"),
    ] {
        let sidecar = format!(
            "[surface.door]\nkind = \"revolving_door\"\nhinge_point_m = {point}\nhinge_axis = [0.0, 0.0, 1.0]\nrange_deg = [0.0, 90.0]\n{key}\n"
        );
        let error = Scene::from_obj_str(&format!("o door\n{FACE}"), Some(&sidecar)).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("door") && text.contains(limit), "{text}");
    }
}
