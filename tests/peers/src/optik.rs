//! The rows of optik, through its Python package: its Rust crate is not published.

use crate::report::Run;
use crate::targets::{Joints, Targets};
use anyhow::{Context, Result, ensure};
use hwall_testkit::Timing;
use serde::{Deserialize, Serialize};
use std::{fs, path::Path, process::Command};

/// What the script is to solve.
#[derive(Serialize)]
struct Task<'a> {
    urdf: &'a Path,
    base: &'a str,
    tip: &'a str,
    /// Row-major 4 x 4 matrices.
    targets: Vec<[[f64; 4]; 4]>,
    starts: &'a [Joints],
    /// Bound on the squared error.
    tol_f: f64,
    max_time_s: f64,
}

/// What it found.
#[derive(Deserialize)]
struct Answers {
    q: Vec<Option<Joints>>,
    ns: Vec<f64>,
    /// A call that does nothing: the price of going through Python, included in `ns`.
    empty_call_ns: f64,
}

/// Runs `optik_solve.py` with the given interpreter.
pub fn inverse(
    python: &Path,
    urdf: &Path,
    targets: &Targets,
    (tol_f, max_time_s): (f64, f64),
) -> Result<Run> {
    let matrix = |pose: &hwall_kinematics::Pose| -> [[f64; 4]; 4] {
        let (r, p) = (pose.rotation(), pose.position_m());
        std::array::from_fn(|row| match row {
            3 => [0.0, 0.0, 0.0, 1.0],
            _ => [r.x_axis[row], r.y_axis[row], r.z_axis[row], p[row]],
        })
    };
    let task = Task {
        urdf,
        base: "base",
        tip: "flange",
        targets: targets.poses.iter().map(matrix).collect(),
        starts: &targets.starts,
        tol_f,
        max_time_s,
    };
    let folder = std::env::temp_dir().join(format!("hwall-peers-{}", std::process::id()));
    fs::create_dir_all(&folder)?;
    let (task_file, answer_file) = (folder.join("task.json"), folder.join("answers.json"));
    fs::write(&task_file, serde_json::to_vec(&task)?)?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("optik_solve.py");
    let status = Command::new(python)
        .arg(script)
        .arg(&task_file)
        .arg(&answer_file)
        .status();
    ensure!(
        status.context("starting Python")?.success(),
        "optik_solve.py failed"
    );
    let answers: Answers = serde_json::from_slice(&fs::read(&answer_file)?)?;
    fs::remove_dir_all(&folder)?;
    ensure!(
        answers.q.len() == targets.poses.len(),
        "an answer for every target"
    );
    Ok(Run {
        method: "optik Robot.ik (Python)".to_owned(),
        setting: format!(
            "tol_f {tol_f:e}, {} ms, 1 thread; empty call {:.0} ns",
            max_time_s * 1e3,
            answers.empty_call_ns
        ),
        answers: answers.q,
        timing: Timing::from_samples_ns(answers.ns),
    })
}
