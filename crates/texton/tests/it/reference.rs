//! All six textures of the dissertation against numbers computed independently (tests/data).

use glam::DVec2;
use hwall_texton::{Patch, ScanAngle, Texture};
use serde_json::Value;

const TRUTH: &str = include_str!("../data/texture_truth.json");

fn textures() -> [(&'static str, Texture); 6] {
    [
        ("released", Texture::released()),
        ("spaced_3_mm", Texture::spaced_3_mm()),
        ("study_1_5", Texture::study_1_5()),
        ("study_2", Texture::study_2()),
        ("study_2_5", Texture::study_2_5()),
        ("study_3", Texture::study_3()),
    ]
}

/// The angles are written with ten decimals; these are what they stand for.
fn angle(deg: f64) -> ScanAngle {
    let exact = [2.0_f64, 3.0].map(f64::atan).map(f64::to_degrees);
    let deg = exact
        .into_iter()
        .find(|e| (e - deg).abs() < 1e-9)
        .unwrap_or(deg);
    ScanAngle::from_deg(deg).unwrap()
}

#[test]
fn widths_spacings_and_encounters_of_all_textures_are_those_of_the_reference() {
    let truth: Value = serde_json::from_str(TRUTH).unwrap();
    let mut compared = 0;
    for (name, texture) in textures() {
        for row in truth["textures"][name].as_array().unwrap() {
            let deg = row["theta_deg"].as_f64().unwrap();
            let scan = angle(deg);
            let met = texture.encounter(scan).unwrap();
            let mut near = |what: &str, ours: Option<f64>| {
                compared += 1;
                match (ours, row[what].as_f64()) {
                    (None, None) => {}
                    (Some(a), Some(b)) => {
                        let is_near = (a - b).abs() < 1e-12 * b.abs().max(1.0);
                        assert!(is_near, "{name} {deg} {what}: {a} {b}");
                    }
                    other => panic!("{name} {deg} {what}: {other:?}"),
                }
            };
            let (texton, least) = (texture.texton(), texture.least_spaced_rad());
            near("w_theta_mm", Some(texton.width_mm(scan)));
            near("width_across_scan_mm", Some(texton.breadth_mm(scan)));
            near("d_ridge_mm", texture.spacing_mm(scan));
            near("theta_min_deg", Some(least.to_degrees()));
            near("d_mean_encounter_mm", Some(texture.mean_encounter_mm(scan)));
            near("t_entry", Some(met.enters_mm));
            near("t_chord_mid", Some(met.middle_mm));
            near("t_own_exit", Some(met.leaves_mm));
            near("t_own_exit", Some(0.5 * texton.contact_length_mm(scan)));
            near("base_gap", Some(met.gap_mm()));
            for speed in [20.0, 80.0] {
                let ridge = texture.ridge_frequency_hz(scan, speed);
                near(&format!("ridge_hz_at_{speed}"), ridge);
                let mean = texture.encounter_frequency_hz(scan, speed);
                near(&format!("mean_encounter_hz_at_{speed}"), Some(mean));
            }
            let neighbour: Vec<i64> = serde_json::from_value(row["neighbour"].clone()).unwrap();
            assert_eq!(met.neighbour.to_vec(), neighbour, "{name} {deg}");
        }
    }
    assert_eq!(compared, 6 * 5 * 14);
}

#[test]
fn spacing_begins_at_the_least_angle() {
    for (name, texture) in textures() {
        let least = texture.least_spaced_rad();
        let spacing = |rad: f64| texture.spacing_mm(ScanAngle::from_rad(rad).unwrap());
        let beside = spacing(least + 1e-9).unwrap();
        assert!((spacing(least).unwrap() - beside).abs() < 1e-7, "{name}");
        assert_eq!(spacing(least - 1e-9), None, "{name}");
        // Along the axes exactly, and not just beside the long one.
        let [long, short] = texture.layout().pitch_mm();
        assert_eq!(texture.spacing_mm(ScanAngle::ALONG), Some(long));
        assert_eq!(texture.spacing_mm(ScanAngle::ACROSS), Some(short));
        assert_eq!(spacing(1e-9), None);
        let beside = spacing(std::f64::consts::FRAC_PI_2 - 1e-9).unwrap();
        assert!((beside - short).abs() < 1e-12, "{name}");
    }
}

#[test]
fn the_released_patch_is_that_of_the_script() {
    let truth: Value = serde_json::from_str(TRUTH).unwrap();
    let truth = &truth["released_patch"];
    let patch = Patch::released();
    assert_eq!(truth["bumps"], patch.counts().placed);
    let number = |what: &str| truth[what].as_f64().unwrap();
    let bumps = patch.volume_mm3() - 200.0 * 200.0;
    assert!((bumps - number("total_bump_volume_mm3")).abs() < 1e-9);
    assert!((patch.coverage() - number("coverage_fraction")).abs() < 1e-15);
    let tiles = patch.tiles();
    assert_eq!(tiles.len(), 4);
    for tile in tiles.iter().map(|t| &t.patch) {
        assert_eq!(tile.counts().placed, 720);
        let mut centres = tile.centres_mm();
        let pair = |what: &str| [0, 1].map(|i| truth[what][i].as_f64().unwrap());
        let near = |a: DVec2, b: [f64; 2]| (0..2).all(|i| (a[i] - b[i]).abs() < 1e-12);
        assert!(near(centres.next().unwrap(), pair("first_centre_mm")));
        assert!(near(centres.last().unwrap(), pair("last_centre_mm")));
    }
}
