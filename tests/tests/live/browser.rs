//! The pages in a browser, where there is one: Chromium and node. Elsewhere these tests say that they were skipped.

use crate::alone;
use anyhow::{Context, ensure};
use glam::DVec3;
use hwall::haptics::Board;
use hwall::haptics::body::{BodyRegion, Capsule};
use hwall::kinematics::{JointPositions, SrsArm};
use hwall_scene::Scene;
use hwall_view::{
    MOST_PARTS, ViewFrame, ViewHand, ViewMarker, ViewMarkerKind, ViewPart, ViewPrediction,
    ViewScene, ViewState, live_page, replay_page,
};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs a script of tests/browser, if there is a node; `None`: skipped.
fn run(script: &str, args: &[&Path]) -> anyhow::Result<Option<String>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("browser")
        .join(script);
    let Ok(output) = Command::new("node").arg(path).args(args).output() else {
        return Ok(None);
    };
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let error = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{script}: {text}{error}");
    Ok((!text.contains("skipped:")).then_some(text))
}

fn report(script: &str, outcome: Option<String>) {
    match outcome {
        Some(text) => print!("{script}: {text}"),
        // Past the capture of `eprintln!`, as for data that are absent.
        None => {
            let _ = writeln!(
                std::io::stderr(),
                "skipped: {script}: no node or no Chromium"
            );
        }
    }
}

/// A replay of a room with a hand that comes and presses; `drives`: on a base that drives and turns.
fn replay(drives: bool) -> anyhow::Result<String> {
    let board = Board::default();
    let arm = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
    let room = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/assets/room.obj");
    let scene = ViewScene::new(
        "In a browser",
        &Scene::from_obj_file(room, None)?.0,
        &arm,
        &board,
    )?;
    let frames = (0..120).map(|i| frame(f64::from(i) / 30.0));
    let frames = frames.map(|frame| ViewFrame {
        base: drives.then(|| (DVec3::new(0.5 * frame.t_s, 2.0, 0.0), frame.t_s)),
        ..frame
    });
    let frames: Vec<ViewFrame> = frames.collect();
    let markers = [ViewMarker {
        t_s: 2.0,
        kind: ViewMarkerKind::Touched,
        text: "touched".to_owned(),
    }];
    Ok(replay_page(&scene, &frames, &markers))
}

fn frame(t_s: f64) -> ViewFrame {
    let share = (t_s / 2.0).min(1.0);
    let q = JointPositions::from_deg([
        0.0,
        40.0 - 10.0 * share,
        0.0,
        -100.0 + 20.0 * share,
        0.0,
        -50.0 + 30.0 * share,
        0.0,
    ]);
    let place = DVec3::new(0.62, 0.0, 0.6);
    let tip_m = place + DVec3::new(0.5, 0.1, -0.2) * (1.0 - share);
    let mut parts = [None; MOST_PARTS];
    for (part, region) in parts.iter_mut().zip([None, Some(BodyRegion::Head)]) {
        let at_m = DVec3::new(if region.is_some() { 1.4 } else { 0.0 }, 0.0, 1.0);
        *part = Some(ViewPart {
            capsule: Capsule {
                from_m: at_m,
                to_m: at_m,
                radius_m: 0.15,
            },
            region,
        });
    }
    let mut hand = ViewHand::LOST;
    hand.joints_m[0] = Some(tip_m + DVec3::X * 0.1);
    hand.joints_m[10] = Some(tip_m);
    ViewFrame {
        hand,
        head_m: Some(DVec3::new(1.4, 0.0, 1.0)),
        gaze: Some((
            DVec3::new(1.4, 0.0, 1.0),
            (place - DVec3::new(1.4, 0.0, 1.0)).normalize(),
        )),
        predicted: Some(ViewPrediction {
            point_m: place,
            normal: DVec3::X,
            surface: Some(0),
            region_m: Some([DVec3::Y * 0.05, DVec3::Z * 0.03]),
            contact_s: Some(2.0 - t_s.min(2.0)),
        }),
        goal: Some((place, DVec3::X)),
        left_s: Some(0.5 * (1.0 - share)),
        parts,
        force_n: (t_s > 2.0).then_some(DVec3::NEG_X * 5.0),
        state: if t_s > 2.0 {
            ViewState::Touched
        } else {
            ViewState::Approaching
        },
        ..ViewFrame::new(t_s, q)
    }
}

fn folder(name: &str) -> anyhow::Result<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).context("a folder for pages")?;
    Ok(folder)
}

#[test]
fn a_replay_opens_without_a_network() -> anyhow::Result<()> {
    let _alone = alone();
    let page = folder("replay_in_a_browser")?.join("replay.html");
    std::fs::write(&page, replay(false)?)?;
    report("replay.mjs", run("replay.mjs", &[&page])?);
    Ok(())
}

#[test]
fn a_base_that_drives_takes_arm_hand_and_camera_along() -> anyhow::Result<()> {
    let _alone = alone();
    let folder = folder("driving_in_a_browser")?;
    let pages = ["stands.html", "drives.html"].map(|name| folder.join(name));
    for (page, drives) in pages.iter().zip([false, true]) {
        std::fs::write(page, replay(drives)?)?;
    }
    report("drives.mjs", run("drives.mjs", &[&pages[0], &pages[1]])?);
    Ok(())
}

#[test]
fn hands_stop_where_no_board_meets_them() -> anyhow::Result<()> {
    report("stop.mjs", run("stop.mjs", &[])?);
    Ok(())
}

#[test]
fn the_live_page_touches_and_reconnects() -> anyhow::Result<()> {
    let _alone = alone();
    let folder = folder("live_in_a_browser")?;
    let (live, played) = (folder.join("live.html"), folder.join("replay.html"));
    std::fs::write(&live, live_page())?;
    std::fs::write(&played, replay(false)?)?;
    report("live.mjs", run("live.mjs", &[&live, &played])?);
    Ok(())
}
