//! A study with a person who answers on the page of questions. Needs Chromium and node; elsewhere it says that it was skipped.

use crate::alone;
use anyhow::{Context, ensure};
use hwall_bridge::QuestionServer;
use hwall_lab::touch_study::people;
use hwall_lab::touch_study::settings::ProtocolArgs;
use hwall_study::{ArmKind, SimulatedStage};
use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::process::Command;
use std::time::Duration;

#[test]
fn a_person_judges_three_conditions() -> anyhow::Result<()> {
    let _alone = alone();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("browser/study.mjs");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("study-in-a-browser");
    let _ = std::fs::remove_dir_all(&folder);
    let protocol = ProtocolArgs {
        factors: vec!["angle".to_owned()],
        levels: vec!["0,45,90".to_owned()],
        practice: Some(1),
        catch_per_block: Some(0),
        break_after: Some(2),
        seed: Some(2),
        ..ProtocolArgs::default()
    };
    let study = people::open(ArmKind::Simulated, &folder, Some(1), &protocol)?;
    let server = QuestionServer::start(SocketAddr::from((Ipv4Addr::LOCALHOST, 0)), Vec::new())?;
    let url = server.url();
    let visitor = std::thread::spawn(move || Command::new("node").arg(script).arg(url).output());
    // Where there is no browser nobody answers; the visitor then ends at once, and the session soon after.
    let mut said = Vec::new();
    let patience = match Command::new("node").arg("--version").output() {
        Ok(_) => Duration::from_secs(60),
        Err(_) => Duration::from_millis(10),
    };
    let mut stage = SimulatedStage::new()?;
    people::by_page(&folder, study, &mut stage, &server, patience, &mut said)?;
    let said = String::from_utf8(said)?;
    let output = visitor.join().ok().context("the visitor's thread")?;
    let text = output.as_ref().map_or(String::new(), |o| {
        String::from_utf8_lossy(&o.stdout).into_owned()
    });
    if output.is_err() || text.contains("skipped:") {
        // Past the capture of `eprintln!`, as for data that are absent.
        let _ = writeln!(
            std::io::stderr(),
            "skipped: study_in_a_browser: no node or no Chromium"
        );
        return Ok(());
    }
    let output = output?;
    let error = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{text}{error}{said}");
    ensure!(said.contains("done"), "{said}");
    // One practice trial, three of the study; two and four, six, eight were typed in.
    let trials = std::fs::read_to_string(folder.join("trials.csv"))?;
    let mut answers: Vec<&str> = trials
        .lines()
        .skip(1)
        .filter_map(|line| line.split(',').nth(12))
        .collect();
    answers.sort_unstable();
    ensure!(answers == ["4", "6", "8"], "{trials}");
    ensure!(
        text.contains("4 numbers typed, 2 buttons pressed"),
        "{text}"
    );
    print!("{text}");
    Ok(())
}
