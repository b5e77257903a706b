//! The pages: complete, small, and without external resources.

use crate::common::{frames, markers, scene};
use data_encoding::BASE64;
use hwall_view::{live_page, replay_page};

/// No address, no source, no import: a page must work without a network.
#[test]
fn nothing_comes_from_elsewhere() {
    let replay = replay_page(&scene(), &frames(2.0), &markers());
    for page in [live_page(), replay] {
        for foreign in [
            "http://", "https://", "src=", "@import", "url(", "import(", "fetch(", "XMLHttp",
        ] {
            assert!(!page.contains(foreign), "{foreign}");
        }
        assert!(!page.contains("{{"), "a part is missing");
        assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"));
    }
}

/// Names cannot break out of their HTML element.
#[test]
fn names_are_no_markup() {
    let page = replay_page(&scene(), &frames(1.0), &markers());
    // Scene, markers, frames, program.
    assert_eq!(page.matches("<script").count(), 4);
    assert_eq!(page.matches("</script").count(), 4);
    assert!(!page.contains("<room>"));
}

#[test]
fn a_minute_takes_less_than_three_megabytes() {
    let page = replay_page(&scene(), &frames(60.0), &markers());
    println!("a minute of whole frames at 30 Hz: {} bytes", page.len());
    assert!(page.len() < 3_000_000, "{}", page.len());
    println!(
        "the page without frames: {} bytes",
        replay_page(&scene(), &[], &[]).len()
    );
}

#[test]
fn the_scene_is_json_with_all_there_is() {
    let json: serde_json::Value = serde_json::from_str(&scene().to_json()).unwrap();
    assert_eq!(json["type"], "scene");
    assert_eq!(json["title"], "A <room> & \"more\"");
    let surfaces = json["surfaces"].as_array().unwrap();
    assert_eq!(surfaces.len(), 4);
    assert_eq!(surfaces[1]["path"]["turns_about_m"][1], 1.0);
    assert_eq!(surfaces[2]["path"]["slides_along"][0], 1.0);
    assert!(surfaces[3]["path"].is_null());
    assert_eq!(json["arm"]["joints"].as_array().unwrap().len(), 7);
    assert_eq!(json["states"].as_array().unwrap().len(), 9);
    assert_eq!(json["base_from_headset"]["rotation"][0], 1.0);
}

/// Corners lie on a fine grid; decoded as the page does, they are unchanged.
#[test]
fn corners_survive_their_grid() {
    let scene = scene();
    let json: serde_json::Value = serde_json::from_str(&scene.to_json()).unwrap();
    for (i, surface) in scene.surfaces.iter().enumerate() {
        let told = &json["surfaces"][i]["triangles"];
        let bytes = BASE64.decode(told["corners"].as_str().unwrap().as_bytes());
        let bytes = bytes.unwrap();
        let step_m = told["step_m"].as_f64().unwrap();
        let values = bytes
            .chunks(2)
            .map(|b| f64::from(u16::from_le_bytes([b[0], b[1]])));
        let read: Vec<f64> = values
            .enumerate()
            .map(|(k, steps)| told["origin_m"][k % 3].as_f64().unwrap() + step_m * steps)
            .collect();
        let written = surface.triangles_m.as_flattened().as_flattened();
        assert_eq!(read.len(), written.len());
        for (read, written) in read.iter().zip(written) {
            assert!((read - f64::from(*written)).abs() <= 0.5 * step_m + 1e-6);
        }
    }
}
