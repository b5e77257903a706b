//! Reads a recording with other tools: the Python packages `mcap` and `mcap-protobuf-support`, Foxglove's own schemas, and `rerun mcap
//! check --full`. If they are absent, the test prints `skipped: ...`.

use crate::common::{file, recorder, run, skeleton};
use hwall_record::{RecorderConfig, Recording};
use std::io::Write;
use std::path::PathBuf;
use std::process::Command;

/// Exit code of the script if nothing could be checked.
const SKIPPED: i32 = 77;

/// Prints a line that no test runner captures.
fn skipped(why: &str) {
    let _ = writeln!(std::io::stderr(), "skipped: others_tools: {why}");
}

#[test]
fn others_tools_read_finished_and_unfinished_recordings() {
    let python = std::env::var("HWALL_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/check.py");
    let (path, left) = (file("others.mcap"), file("left.mcap"));
    let config = RecorderConfig {
        flush_s: 0.0,
        ..RecorderConfig::simulated()
    };
    let mut to = recorder(&path, &config);
    run(&mut to, 0, 3.0);
    run(&mut to, 1, 0.5);
    std::thread::sleep(std::time::Duration::from_millis(500));
    // The file that a killed program leaves.
    std::fs::copy(&path, &left).unwrap();
    to.finish().unwrap();
    let urdf = path.with_extension("urdf");
    std::fs::write(&urdf, skeleton().to_urdf("iiwa7")).unwrap();
    let count = |path| Recording::open(path).unwrap().inputs().count().to_string();
    let args = [&path, &left, &urdf].map(|path| path.as_os_str().to_owned());
    let output = Command::new(&python)
        .arg(&script)
        .args(args)
        .args([count(&path), count(&left)])
        .output();
    for path in [&path, &left, &urdf] {
        std::fs::remove_file(path).unwrap();
    }
    let Ok(output) = output else {
        return skipped(&format!("no {python}"));
    };
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr);
    for line in text.lines().filter(|line| line.starts_with("skipped: ")) {
        let _ = writeln!(std::io::stderr(), "{line}");
    }
    match output.status.code() {
        Some(0) => {}
        Some(SKIPPED) => {}
        _ => panic!("{text}\n{errors}"),
    }
}
