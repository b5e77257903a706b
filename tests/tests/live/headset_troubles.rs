//! What owners of headsets report of pages such as this one, each tried in an emulated headset. Needs what `bridge_in_a_browser` needs.

use crate::alone;
use crate::bridge_in_a_browser::{printed, script};
use anyhow::{Context, ensure};
use hwall::haptics::Board;
use hwall::kinematics::{JointPositions, SrsArm};
use hwall_bridge::view::{ViewFrame, ViewScene};
use hwall_bridge::{BridgeConfig, BridgeServer};
use hwall_scene::Scene;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::process::Command;

/// Frames that the loop got: with a hand; without one, but with a head.
#[derive(Debug, Default)]
struct Frames {
    with_hand: u64,
    head_alone: u64,
}

/// Lets an emulated headset have this trouble with a page that shows a room and an arm at rest.
fn troubled(trouble: &str) -> anyhow::Result<Frames> {
    let _alone = alone();
    let mut frames = Frames::default();
    let Some((script, iwer)) = script("troubles.mjs") else {
        return Ok(frames);
    };
    let server = BridgeServer::start(BridgeConfig {
        listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
        ..BridgeConfig::default()
    })?;
    let board = Board::default();
    let arm = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
    let room = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/assets/room.obj");
    let room = Scene::from_obj_file(room, None)?.0;
    let mut bridge = server.connect(&ViewScene::new("At rest", &room, &arm, &board)?);
    let mut command = Command::new("node");
    command.arg(script).arg(server.url()).arg(trouble).arg(iwer);
    let stop = server.stop_handle();
    let visitor = std::thread::spawn(move || {
        let printed = printed(command);
        stop.stop();
        printed
    });
    let q = JointPositions::from_deg([0.0, 40.0, 0.0, -100.0, 0.0, -50.0, 0.0]);
    while !server.is_stopped() {
        let now_s = bridge.pacing.wait();
        while let Some(frame) = bridge.hands.next_frame(now_s) {
            let is_seen = frame.palm_m.is_some();
            frames.with_hand += u64::from(is_seen);
            frames.head_alone += u64::from(!is_seen && frame.head_m.is_some());
        }
        if bridge.view.is_due(now_s) {
            bridge.view.send(&ViewFrame::new(now_s, q));
        }
    }
    visitor.join().ok().context("the visitor's thread")??;
    ensure!(frames.with_hand > 0, "{frames:?}");
    Ok(frames)
}

#[test]
fn a_socket_that_ends_when_vr_is_entered_comes_back() -> anyhow::Result<()> {
    troubled("socket").map(drop)
}

#[test]
fn half_a_minute_of_silence_does_not_end_the_socket() -> anyhow::Result<()> {
    troubled("silence").map(drop)
}

/// Regression: the head was lost with the hands where a headset then has no source for them.
#[test]
fn hands_that_leave_the_view_are_told_and_the_head_stays() -> anyhow::Result<()> {
    let frames = troubled("hands")?;
    let is_skipped = frames.with_hand == 0;
    ensure!(is_skipped || frames.head_alone > 20, "{frames:?}");
    Ok(())
}

#[test]
fn the_page_in_a_headset_needs_no_internet() -> anyhow::Result<()> {
    troubled("internet").map(drop)
}

/// Regression: a page whose graphics were taken away stayed without a picture.
#[test]
fn the_scene_in_a_headset_is_not_black() -> anyhow::Result<()> {
    troubled("black").map(drop)
}

#[test]
fn the_list_before_vr_says_what_is_missing() -> anyhow::Result<()> {
    troubled("checks").map(drop)
}
