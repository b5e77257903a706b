//! Exact reachability of flange poses, row by row.
//!
//! `echo "px,py,pz,qw,qx,qy,qz
//! 0.5,0,0.6,0.7071,0,0.7071,0" | cargo run --release --example reach_check`

use anyhow::Context;
use clap::Parser;
use glam::{DQuat, DVec3};
use hwall_kinematics::{Pose, SrsArm, Verdict};
use hwall_stage::arms::NamedArm;
use hwall_stage::numbers::{TableFiles, numbered, to_cells};
use hwall_stage::{exit, note};
use hwall_testkit::time_batches;
use std::process::ExitCode;

/// Can the arm hold each flange pose? With a witness, or the reason why not.
///
/// In: CSV with a header line, px,py,pz in metres and the quaternion qw,qx,qy,qz, flange in the
/// base frame. Out: reachable (1 or 0), reason (empty when reachable; too_far, too_near,
/// elbow_limit, shoulder_limit, wrist_limit, arm_angle_conflict), q1..q7 of a witness in rad
/// (empty when unreachable; a proof, not a posture: it may lie on a limit), margin_rad: the largest angle by which every joint limit can shrink
/// with the pose still reachable, negative where the limits would have to widen, empty where no
/// limits within 1 rad of these would do.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    arm: NamedArm,
    /// Report nanoseconds per verdict on standard error
    #[arg(long)]
    timing: bool,
    #[command(flatten)]
    files: TableFiles,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    args.files.plan().check()?;
    let arm = args.arm.closed_form()?;
    let mut input = args.files.reader()?;
    let names = ["px", "py", "pz", "qw", "qx", "qy", "qz"].map(String::from);
    let places = input.columns(&names)?;
    let mut output = args.files.writer()?;
    let mut header = vec!["reachable".to_owned(), "reason".to_owned()];
    header.extend(numbered("q", 7));
    header.push("margin_rad".to_owned());
    output.write_record(&header)?;

    let (mut reachable, mut unreachable) = (Vec::new(), Vec::new());
    while let Some(row) = input.next_row()? {
        let v = input.values(&row, &places)?;
        let quat = DQuat::from_xyzw(v[4], v[5], v[6], v[3]);
        let pose = Pose::from_quat(quat, DVec3::new(v[0], v[1], v[2]))
            .with_context(|| input.place(&row))?;
        let mut cells = match arm.verdict(&pose) {
            Verdict::Reachable(witness) => {
                reachable.push(pose);
                let mut cells = vec!["1".to_owned(), String::new()];
                cells.extend(to_cells(witness.q.0));
                cells
            }
            Verdict::Unreachable(reason) => {
                unreachable.push(pose);
                let mut cells = vec!["0".to_owned(), reason.name().to_owned()];
                cells.extend(vec![String::new(); 7]);
                cells
            }
        };
        cells.push(
            arm.joint_margin_rad(&pose)
                .map_or(String::new(), |m| m.to_string()),
        );
        output.write_record(&cells)?;
    }
    output.flush()?;
    if args.timing {
        report("reachable", &arm, &reachable);
        report("unreachable", &arm, &unreachable);
    }
    Ok(())
}

fn report(what: &str, arm: &SrsArm, poses: &[Pose]) {
    if poses.is_empty() {
        note(format_args!("{what}: no poses"));
        return;
    }
    let timing = time_batches(500, poses.len().clamp(1, 200), |i| {
        arm.is_reachable(&poses[i % poses.len()])
    });
    note(format_args!(
        "{what}: {} poses, median {:.0} ns, p99 {:.0} ns per verdict",
        poses.len(),
        timing.median_ns,
        timing.p99_ns
    ));
}
