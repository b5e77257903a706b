//! Files that are missing or malformed end in one clear line, never in a panic.

use clap::Parser;
use hwall_haptics::Board;
use hwall_stage::arms::BoardArm;
use hwall_stage::setting::{Setting, SettingFlags};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

const WALL: &str = "o wall\nv 1 -1 0\nv 1 1 0\nv 1 1 2\nv 1 -1 2\nf 1 2 3 4\n";

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// A file in the folder that cargo gives to integration tests.
fn file(name: &str, content: &[u8]) -> PathBuf {
    let path = path(name);
    std::fs::write(&path, content).unwrap();
    path
}

/// The line that `error: ...` would show, checked to be one line and not too long.
fn refusal(scene: Option<&Path>, hand: Option<&Path>, auto: bool) -> String {
    let arm = BoardArm::named("iiwa7", &Board::default()).unwrap();
    let place = if auto { "--place=auto" } else { "--place=none" };
    let mut words = ["", "--axes=z-up", place].map(OsStr::new).to_vec();
    for (flag, path) in [("--scene", scene), ("--hand", hand)] {
        if let Some(path) = path {
            words.extend([OsStr::new(flag), path.as_os_str()]);
        }
    }
    let options = SettingFlags::parse_from(words);
    let error = Setting::new(&arm, &options)
        .map(|_| ())
        .expect_err("must be refused");
    let line = format!("{error:#}");
    println!("{line}");
    assert!(!line.contains('\n') && line.len() < 300, "{line}");
    line
}

#[test]
fn a_missing_scene_or_recording_is_named() {
    assert!(refusal(Some(&path("nowhere.obj")), None, false).contains("nowhere.obj"));
    let scene = file("missing_hand.obj", WALL.as_bytes());
    assert!(refusal(Some(&scene), Some(&path("nobody.csv")), true).contains("nobody.csv"));
    // A folder is no file.
    assert!(!refusal(Some(&path("")), None, false).is_empty());
}

#[test]
fn a_malformed_scene_names_the_line_and_what_is_wrong() {
    for (name, content, wanted) in [
        ("short.obj", &b"o wall\nv 1 2\nf 1 1 1\n"[..], "line 2"),
        ("words.obj", b"o wall\nv 1 2 here\n", "line 2"),
        ("nan.obj", b"v 0 0 0\nv nan 1 0\nf 1 2 2\n", "line 2"),
        ("index.obj", b"v 0 0 0\nv 0 1 0\nv 0 1 1\nf 1 2 9\n", "9"),
        ("empty.obj", b"", "no face"),
        ("image.obj", b"\x89PNG\r\n\x1a\n\xff\xfe", "not"),
    ] {
        let path = file(name, content);
        let line = refusal(Some(&path), None, false);
        assert!(line.contains(wanted), "{name}: {line}");
    }
    let path = file("sidecar.obj", WALL.as_bytes());
    file("sidecar.toml", b"[surface.door]\nkind = \"static\"\n");
    assert!(refusal(Some(&path), None, false).contains("door"));
}

#[test]
fn a_malformed_recording_names_the_line_and_what_is_wrong() {
    let scene = file("hand_wall.obj", WALL.as_bytes());
    let said = |content: &[u8]| refusal(Some(&scene), Some(&file("bad.csv", content)), true);
    for (content, wanted) in [
        (&b""[..], "header"),
        (b"t,a,b\n0,1,2\n", "hand"),
        (b"t,palm_x,palm_y\n0,1,2\n", "palm_z"),
        (b"\x89PNG\r\n\x1a\n\xff\xfe", "column \"t\""),
    ] {
        assert!(said(content).contains(wanted), "{wanted}");
    }
    for (rows, wanted) in [
        ("", "no samples"),
        ("0,1,2,3\n1,here,2,3\n", "line 3"),
        ("0,NaN,2,3\n", "line 2"),
        ("0,1,2\n", "line 2"),
        ("1,1,2,3\n0,1,2,3\n", "line 3"),
        ("0,1,2,3\n0.01,1,2,3\n", "reach"),
    ] {
        let line = said(format!("t,palm_x,palm_y,palm_z\n{rows}").as_bytes());
        assert!(line.contains(wanted), "{rows:?}: {line}");
    }
}

#[test]
fn placing_without_a_recording_and_a_scene_out_of_reach_are_told() {
    assert!(refusal(None, None, true).contains("--hand"));
    let far = file("far.obj", WALL.replace("v 1 ", "v 9 ").as_bytes());
    assert!(refusal(Some(&far), None, false).contains("reach"));
    let centimetres = b"v 100 -100 0\nv 100 100 0\nv 100 100 200\nv 100 -100 200\nf 1 2 3 4\n";
    let line = refusal(Some(&file("centimetres.obj", centimetres)), None, false);
    let hint = "looks like centimetres: --scale 0.01";
    assert!(line.contains(hint), "{line}");
    let floor = file("floor.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert!(refusal(Some(&floor), None, false).contains("vertical"));
}

/// A hand whose points never move against each other is taken for a frozen tracker: whoever made it up is told of the flag.
#[test]
fn a_made_up_hand_is_told_of_its_flag_at_once() {
    let scene = file("rigid_wall.obj", WALL.as_bytes());
    let mut text =
        "t,palm_x,palm_y,palm_z,index_x,index_y,index_z,thumb_x,thumb_y,thumb_z\n".to_owned();
    for k in 0..200 {
        let t_s = f64::from(k) / 90.0;
        let tau = ((t_s - 0.5) / 0.8).clamp(0.0, 1.0);
        let x = 0.5 * tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
        let y = 1e-3 * (7.0 * t_s).sin();
        let (i, th) = (x + 0.09, x + 0.05);
        text += &format!("{t_s},{x},{y},1,{i},{y},1.01,{th},{},1\n", y + 0.04);
    }
    let hand = file("rigid.csv", text.as_bytes());
    let line = refusal(Some(&scene), Some(&hand), true);
    assert!(line.contains("--rigid-hand"), "{line}");
}
