//! Roughness for surfaces from pictures: order, levels, files.

use hwall_lab::texture::assign::{AssignArgs, run};
use hwall_texton::HeightField;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

fn scratch(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("hwall_assign_{}_{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Waves of 0.4 mm, of this height, in an EXR file that states its units.
fn exr(folder: &Path, name: &str, height_mm: f64) -> String {
    let side = 128;
    let wave = |k: usize| {
        let [x, y] = [k % side, k / side].map(|i| (TAU * i as f64 / 16.0).sin());
        (height_mm * (x + y)) as f32
    };
    let heights = (0..side * side).map(wave).collect();
    let path = folder.join(name);
    HeightField::new(side, 0.025, heights)
        .unwrap()
        .write_exr(&path)
        .unwrap();
    path.display().to_string()
}

fn args(images: Vec<String>) -> AssignArgs {
    AssignArgs {
        images,
        ..AssignArgs::default()
    }
}

fn ran(args: &AssignArgs) -> Result<String, String> {
    let mut out = Vec::new();
    run(args, &mut out).map_err(|error| format!("{error:#}"))?;
    Ok(String::from_utf8(out).unwrap())
}

#[test]
fn rougher_pictures_get_rougher_levels_and_the_sidecar_reads_them() {
    let folder = scratch("order");
    let [json, sidecar] = ["a.json", "room.toml"].map(|name| folder.join(name));
    std::fs::write(&sidecar, "# A room.\n[surface.door]\nroughness = 0.4\n").unwrap();
    // The shelf is steeper than all materials of the calibration.
    let images = [("door", 0.05), ("shelf front", 0.2), ("wall", 0.025)];
    let images =
        images.map(|(name, mm)| format!("{name}={}", exr(&folder, &format!("{name}.exr"), mm)));
    let all = AssignArgs {
        json: Some(json.clone()),
        sidecar: Some(sidecar.clone()),
        ..args(images.to_vec())
    };
    let text = ran(&all).unwrap();
    assert!(text.contains("0 deg, 20 mm/s"), "{text}");
    assert!(text.contains("friction"), "{text}");
    let told: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    let told = told["surfaces"].as_array().unwrap();
    let names = told.iter().map(|one| one["surface"].as_str().unwrap());
    let names: Vec<&str> = names.collect();
    assert_eq!(names, ["wall", "door", "shelf front"]);
    let rough = |i: usize| told[i]["roughness"].as_f64().unwrap();
    assert!(rough(0) < rough(1) && rough(1) < rough(2));
    assert!(told[0]["rougher_than_before"].is_null());
    assert!(told[1]["rougher_than_before"].as_f64().unwrap() > 0.9);
    assert!(told[1]["interval_90"].is_array());
    assert!(told[2]["rougher_than_before"].is_null() && told[2]["interval_90"].is_null());
    assert!(text.contains("beyond the calibration") && text.contains("unknown"));
    assert!(!text.contains("created"), "{text}");
    let written = std::fs::read_to_string(&sidecar).unwrap();
    let entry = "# A room.\n[surface.door]\nroughness = ";
    assert!(written.starts_with(entry), "{written}");
    // The scene can read the written file.
    let triangle = |name| format!("o {name}\nv 1 0 0\nv 1 1 0\nv 1 1 1\nf -3 -2 -1\n");
    let obj = ["door", "shelf front", "wall"].map(triangle).concat();
    let (scene, _) = hwall_scene::Scene::from_obj_str(&obj, Some(&written)).unwrap();
    for surface in scene.surfaces() {
        let place = names.iter().position(|name| *name == surface.name).unwrap();
        let share = surface.roughness.unwrap() / rough(place);
        assert!((0.95..1.06).contains(&share), "{} {share}", surface.name);
    }
    // The same again changes nothing.
    ran(&all).unwrap();
    assert_eq!(std::fs::read_to_string(&sidecar).unwrap(), written);
}

/// A mistyped name made a new file without a word.
#[test]
fn a_new_sidecar_is_told() {
    let folder = scratch("new");
    let sidecar = folder.join("nosuch.toml");
    let all = AssignArgs {
        sidecar: Some(sidecar.clone()),
        ..args(vec![exr(&folder, "wall.exr", 0.05)])
    };
    let line = format!("created {}\n", sidecar.display());
    assert!(ran(&all).unwrap().ends_with(&line));
    assert!(!ran(&all).unwrap().contains("created"));
}

#[test]
fn what_cannot_be_told_is_refused_by_name() {
    let folder = scratch("refused");
    let flat = exr(&folder, "flat.exr", 0.0);
    let good = exr(&folder, "good.exr", 0.1);
    let png = folder.join("a.png").display().to_string();
    std::fs::write(&png, "no picture").unwrap();
    let named = format!("a={good}");
    for (images, because) in [
        (vec![flat], &["uniform"][..]),
        (
            vec![named.clone(), named],
            &["two pictures for the surface a"],
        ),
        (vec![format!("{good}@30")], &["nearer"]),
        (vec![png.clone()], &["a.png", "width"]),
        (vec![format!("{png}@0.1")], &["a.png"]),
        (vec!["missing.png@0.1".to_owned()], &["missing.png"]),
    ] {
        let error = ran(&args(images)).unwrap_err();
        for word in because {
            assert!(error.contains(word), "{word}: {error}");
        }
    }
    let onto = AssignArgs {
        json: Some(PathBuf::from(&good)),
        ..args(vec![good])
    };
    assert!(ran(&onto).unwrap_err().contains("IMAGE"));
}

#[test]
fn the_calibration_is_printed_with_its_error() {
    let shown = AssignArgs {
        calibration: true,
        ..args(Vec::new())
    };
    let text = ran(&shown).unwrap();
    assert!(text.contains("P80"), "{text}");
    assert!(text.contains("left out is off by a factor of"), "{text}");
}
