//! The bridge as people use it: a mouse on the page, hands in a headset. Needs Chromium, node and the emulated headset iwer
//! (`npm install --prefix target/browser iwer@2.5.0`); elsewhere it says that it was skipped.

use crate::alone;
use anyhow::{Context, ensure};
use clap::Parser;
use hwall::geometry::Pose;
use hwall::glam::DVec3;
use hwall_bridge::{BridgeConfig, BridgeServer};
use hwall_stage::live::{LiveFlags, prepare, run_simulated};
use std::f64::consts::PI;
use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The folder of iwer: HWALL_IWER names it, or `target/browser` has it.
fn iwer() -> Option<PathBuf> {
    let named = std::env::var_os("HWALL_IWER").map(PathBuf::from);
    let built = Path::new(env!("CARGO_TARGET_TMPDIR")).join("../browser/node_modules/iwer");
    [named, Some(built)]
        .into_iter()
        .flatten()
        .find(|folder| folder.join("build/iwer.min.js").exists())
}

fn is_there(command: &str, args: &[&str]) -> bool {
    Command::new(command)
        .args(args)
        .output()
        .is_ok_and(|output| output.status.success())
}

/// What is missing for the test.
fn missing(script: &Path) -> Option<&'static str> {
    let browser = "import(process.argv[1]).then((m) => process.exit(m.findChromium() ? 0 : 1))";
    let chromium = script.with_file_name("chromium.mjs");
    let chromium = chromium.to_string_lossy();
    if !is_there("node", &["--version"]) {
        Some("no node")
    } else if !is_there("node", &["-e", browser, &chromium]) {
        Some("no Chromium")
    } else if iwer().is_none() {
        Some("no iwer")
    } else {
        None
    }
}

#[test]
fn a_mouse_and_a_hand_in_a_headset_touch_a_board_in_place() -> anyhow::Result<()> {
    let _alone = alone();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("browser/reach.mjs");
    if let Some(missing) = missing(&script) {
        // Past the capture of `eprintln!`, as for data that are absent.
        let _ = writeln!(std::io::stderr(), "skipped: bridge_in_a_browser: {missing}");
        return Ok(());
    }
    let server = BridgeServer::start(BridgeConfig {
        listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
        base_from_headset: Pose::from_yaw(PI, DVec3::new(1.5, 0.0, -0.6))?,
        ..BridgeConfig::default()
    })?;
    let (url, stop) = (server.url(), server.stop_handle());
    let visitor = std::thread::spawn(move || {
        let iwer = iwer().context("iwer")?;
        let output = Command::new("node").arg(script).arg(url).arg(iwer).output();
        stop.stop();
        anyhow::Ok(output?)
    });
    let flags = LiveFlags::parse_from(["", "--seconds", "600"]);
    let prepared = prepare(&server, &flags)?;
    run_simulated(&server, prepared, &flags)?;
    let output = visitor.join().ok().context("the visitor's thread")??;
    let text = String::from_utf8_lossy(&output.stdout);
    let error = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{text}{error}");
    print!("{text}");
    Ok(())
}
