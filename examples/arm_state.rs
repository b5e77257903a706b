//! Pose, Jacobian and dynamics of an arm, row by row.
//!
//! `echo "q1,q2,q3,q4,q5,q6,q7
//! 0,0.5,0,-1.2,0,0.8,0" | cargo run --release --example arm_state -- --dynamics`

use clap::Parser;
use hwall_kinematics::ChainDynamics;
use hwall_stage::arms;
use hwall_stage::exit;
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::numbers::{NumberReader, matrix_names, numbered, to_cells, writer};
use std::path::PathBuf;
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
    /// iiwa7, iiwa14, or the path of a URDF file
    #[arg(long, default_value = "iiwa7")]
    arm: String,
    /// Add gravity torque, mass matrix and inverse dynamics
    #[arg(long)]
    dynamics: bool,
    /// Read this CSV file instead of standard input
    #[arg(long = "in")]
    input: Option<PathBuf>,
    /// Write this CSV file instead of standard output
    #[arg(long = "out")]
    output: Option<PathBuf>,
}

fn main() -> ExitCode {
    exit(run(&Args::parse()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    FilePlan::tables(args.input.as_deref(), args.output.as_deref()).check()?;
    let chain = arms::chain(&args.arm)?;
    let n = chain.joint_count();
    let dynamics = args
        .dynamics
        .then(|| ChainDynamics::new(&chain))
        .transpose()?;
    let mut input = NumberReader::open(args.input.as_deref())?;
    let q_places = input.columns(&numbered("q", n))?;
    let optional = |prefix: &str| {
        let names = numbered(prefix, n);
        // One of them is enough to ask for all: a single missing column is named.
        let any = args.dynamics && names.iter().any(|name| input.has(name));
        any.then(|| input.columns(&names)).transpose()
    };
    let (qd_places, qdd_places) = (optional("qd")?, optional("qdd")?);

    let mut output = writer(args.output.as_deref())?;
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
        let q = input.values(&row, &q_places)?;
        let pose = chain.forward_jacobian_into(&q, &mut scratch)?;
        let columns = scratch.jacobian_columns();
        let mut values = pose.position_m().to_array().to_vec();
        values.extend(pose.rotation().transpose().to_cols_array());
        values.extend((0..6).flat_map(|r| columns.iter().map(move |c| c[r])));
        if let Some(dynamics) = &dynamics {
            let rates = |places: &Option<Vec<usize>>| match places {
                Some(places) => input.values(&row, places),
                None => Ok(vec![0.0; n]),
            };
            values.extend(dynamics.gravity_torque(&q)?);
            values.extend(dynamics.mass_matrix(&q)?);
            values.extend(dynamics.inverse(&q, &rates(&qd_places)?, &rates(&qdd_places)?)?);
        }
        output.write_record(to_cells(values))?;
    }
    output.flush()?;
    Ok(())
}
