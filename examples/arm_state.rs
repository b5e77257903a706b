//! Pose, Jacobian and dynamics of an arm, row by row.
//!
//! `echo "q1,q2,q3,q4,q5,q6,q7
//! 0,0.5,0,-1.2,0,0.8,0" | cargo run --release --example arm_state -- --dynamics`

use anyhow::Context;
use clap::Parser;
use hwall_kinematics::ChainDynamics;
use hwall_stage::arms::NamedArm;
use hwall_stage::exit;
use hwall_stage::numbers::{TableFiles, matrix_names, numbered, to_cells};
use std::process::ExitCode;

/// Flange pose, Jacobian and dynamics for each row of joint angles.
///
/// In: CSV with a header line, columns q1..q7 in rad, with --dynamics optionally qd1..qd7 (rad/s)
/// and qdd1..qdd7 (rad/s²), zero when absent. Out: px,py,pz in metres, r11..r33 (rotation,
/// row-major), j11..j67 (Jacobian, 6 x 7 row-major, linear then angular, base axes, at the
/// flange); with --dynamics also g1..g7 (gravity torque, N m), m11..m77 (mass matrix, kg m²) and
/// tau1..tau7 (inverse dynamics, N m). Joint limits are not applied. An arm with n joints has n columns instead of seven.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    arm: NamedArm,
    /// Add gravity torque, mass matrix and inverse dynamics
    #[arg(long)]
    dynamics: bool,
    #[command(flatten)]
    files: TableFiles,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    args.files
        .plan()
        .read_arm("--arm", &args.arm.name)
        .check()?;
    let chain = args.arm.chain()?;
    let n = chain.joint_count();
    let dynamics = args
        .dynamics
        .then(|| ChainDynamics::new(&chain))
        .transpose()?;
    let mut input = args.files.reader()?;
    let q_places = input.columns(&numbered("q", n))?;
    let optional = |prefix: &str| {
        let names = numbered(prefix, n);
        // One of them is enough to ask for all: a single missing column is named.
        let any = args.dynamics && names.iter().any(|name| input.has(name));
        any.then(|| input.columns(&names)).transpose()
    };
    let (qd_places, qdd_places) = (optional("qd")?, optional("qdd")?);

    let mut output = args.files.writer()?;
    let mut header: Vec<String> = ["px", "py", "pz"].map(String::from).to_vec();
    header.extend(matrix_names("r", 3, 3));
    header.extend(matrix_names("j", 6, n));
    if dynamics.is_some() {
        header.extend(numbered("g", n));
        header.extend(matrix_names("m", n, n));
        header.extend(numbered("tau", n));
    }
    output.write_record(&header)?;

    let mut scratch = chain.scratch();
    while let Some(row) = input.next_row()? {
        let place = || input.place(&row);
        let q = input.values(&row, &q_places)?;
        let pose = chain
            .forward_jacobian_into(&q, &mut scratch)
            .with_context(place)?;
        let columns = scratch.jacobian_columns();
        let mut values = pose.position_m().to_array().to_vec();
        values.extend(pose.rotation().transpose().to_cols_array());
        values.extend((0..6).flat_map(|r| columns.iter().map(move |c| c[r])));
        if let Some(dynamics) = &dynamics {
            let rates = |places: &Option<Vec<usize>>| match places {
                Some(places) => input.values(&row, places),
                None => Ok(vec![0.0; n]),
            };
            let (qd, qdd) = (rates(&qd_places)?, rates(&qdd_places)?);
            values.extend(dynamics.gravity_torque(&q).with_context(place)?);
            values.extend(dynamics.mass_matrix(&q).with_context(place)?);
            values.extend(dynamics.inverse(&q, &qd, &qdd).with_context(place)?);
        }
        output.write_record(to_cells(values))?;
    }
    output.flush()?;
    Ok(())
}
