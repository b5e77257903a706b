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

/// A script of tests/browser and the folder of iwer; `None`, and said, if something is missing for it.
pub(crate) fn script(name: &str) -> Option<(PathBuf, PathBuf)> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("browser")
        .join(name);
    let found = match missing(&script) {
        Some(missing) => Err(missing),
        None => iwer().ok_or("no iwer"),
    };
    match found {
        Ok(iwer) => Some((script, iwer)),
        Err(missing) => {
            // Past the capture of `eprintln!`, as for data that are absent.
            let _ = writeln!(std::io::stderr(), "skipped: {name}: {missing}");
            None
        }
    }
}

/// What a script printed; an error if it failed. HWALL_PICTURES names a folder for its pictures.
pub(crate) fn printed(mut command: Command) -> anyhow::Result<String> {
    command.args(std::env::var_os("HWALL_PICTURES"));
    let output = command.output()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let error = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{text}{error}");
    print!("{text}");
    Ok(text)
}

/// A session on a simulated arm that a visitor's script touches until it ends.
fn visited(
    config: BridgeConfig,
    predictor: &str,
    visit: impl FnOnce(&BridgeServer) -> Command,
) -> anyhow::Result<()> {
    let server = BridgeServer::start(config)?;
    let (command, stop) = (visit(&server), server.stop_handle());
    let visitor = std::thread::spawn(move || {
        let printed = printed(command);
        stop.stop();
        printed
    });
    let flags = LiveFlags::parse_from(["", "--seconds", "600", "--predictor", predictor]);
    let prepared = prepare(&server, &flags)?;
    run_simulated(&server, prepared, &flags)?;
    visitor.join().ok().context("the visitor's thread")??;
    Ok(())
}

fn config() -> anyhow::Result<BridgeConfig> {
    Ok(BridgeConfig {
        listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
        base_from_headset: Pose::from_yaw(PI, DVec3::new(1.5, 0.0, -0.6))?,
        ..BridgeConfig::default()
    })
}

#[test]
fn a_mouse_and_a_hand_in_a_headset_touch_a_board_in_place() -> anyhow::Result<()> {
    let _alone = alone();
    let Some((script, iwer)) = script("reach.mjs") else {
        return Ok(());
    };
    visited(config()?, "fused", |server| {
        let mut command = Command::new("node");
        command.arg(script).arg(server.url()).arg(iwer);
        command
    })
}

/// On the network, as a headset without a cable is: HTTPS under a name that is not this machine's own, a calibration by three touches, then a wall.
#[test]
#[cfg(feature = "tls")]
fn an_emulated_headset_over_tls_calibrates_and_touches_a_board_in_place() -> anyhow::Result<()> {
    use hwall_bridge::{Calibration, Certificate};

    const NAME: &str = "headset-test.example";
    let _alone = alone();
    let Some((script, iwer)) = script("tls.mjs") else {
        return Ok(());
    };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("over_tls");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder)?;
    let calibration = folder.join("headset.json");
    let config = BridgeConfig {
        hosts: vec![NAME.to_owned()],
        certificate: Some(Certificate::SelfSigned(folder.join("tls/bridge.pem"))),
        calibration: Some(calibration.clone()),
        ..config()?
    };
    // Not where the server believes it: half a metre and 20 degrees elsewhere.
    let stands = "1.45,0.35,-0.57,160";
    visited(config, "fused", |server| {
        let (invitation, url) = (server.invitation(), server.url());
        let fingerprint = invitation
            .lines()
            .find(|line| line.matches(':').count() == 31);
        let mut command = Command::new("node");
        command
            .arg(script)
            .arg(server.address().port().to_string())
            .args([NAME, url.trim_start_matches(|c| c != '?')])
            .args([fingerprint.unwrap_or("none"), stands])
            .arg(iwer);
        command
    })?;
    let kept = Calibration::from_json(&std::fs::read_to_string(calibration)?)?;
    let truth = Pose::from_yaw(160f64.to_radians(), DVec3::new(1.45, 0.35, -0.57))?;
    let off = kept.base_from_headset().distance(&truth);
    ensure!(off.position_m < 0.005 && off.angle_rad < 0.01, "{off:?}");
    Ok(())
}
