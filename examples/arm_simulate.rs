//! Motion of an arm under gravity, joint torques and a wrench at the flange.
//!
//! `cargo run --release --example arm_simulate -- --start 0,0.5,0,-1.2,0,0.8,0 --gravity-only --duration 0.5`

use anyhow::{Context, ensure};
use clap::{Parser, ValueEnum};
use glam::{DMat3, DVec3};
use hwall_kinematics::{Chain, ChainDynamics, Inertial, Wrench};
use hwall_sim::{
    ChainMotion, ChainMotionConfig, HeldTorques, Integrator, JointFriction, MotionSampling,
    sample_motion,
};
use hwall_stage::arms;
use hwall_stage::exit;
use hwall_stage::numbers::{numbered, to_cells, writer};
use std::io::BufRead;
use std::process::ExitCode;

/// Motion of rigid links under gravity, torques and a wrench.
///
/// In: CSV rows t,tau1..tau7 (s, N m) on standard input, with or without that header; each row's torques hold until the time
/// of the next row, before the first row they are zero. Out: CSV t,q1..q7,qd1..qd7,energy_j (s, rad, rad/s, J; potential
/// energy zero for a mass at the base origin) at 0, every, 2 every ... and at the duration. No friction, rotor inertia, joint
/// limits or saturation unless asked for. An arm with n joints has n columns and values instead of seven.
#[derive(Parser)]
struct Args {
    /// iiwa7, iiwa14, or the path of a URDF file
    #[arg(long, default_value = "iiwa7")]
    arm: String,
    /// Joint angles at the start, rad: q1,..,q7; zero when absent
    #[arg(long, allow_hyphen_values = true)]
    start: Option<String>,
    /// Joint velocities at the start, rad/s; zero when absent
    #[arg(long, allow_hyphen_values = true)]
    start_velocity: Option<String>,
    /// Viscous friction of the joints, N m s/rad
    #[arg(long, allow_hyphen_values = true)]
    viscous: Option<String>,
    /// Dry friction of the joints, N m
    #[arg(long, allow_hyphen_values = true)]
    coulomb: Option<String>,
    /// Inertia of the rotors as the joints feel it, kg m²
    #[arg(long, allow_hyphen_values = true)]
    rotor_inertia: Option<String>,
    /// Stop the joints at their limits, without rebound
    #[arg(long)]
    joint_limits: bool,
    /// Limit the torques to those that the arm's description allows
    #[arg(long)]
    saturate: bool,
    /// Constant wrench on the flange, base axes, about the flange: fx,fy,fz,mx,my,mz in N and N m
    #[arg(long, allow_hyphen_values = true)]
    wrench: Option<String>,
    /// No torques: standard input is not read
    #[arg(long)]
    gravity_only: bool,
    /// Length of the motion, s
    #[arg(long, default_value_t = 1.0)]
    duration: f64,
    /// Time between rows of the output, s
    #[arg(long, default_value_t = 0.01)]
    every: f64,
    /// How to integrate
    #[arg(long, value_enum, default_value_t = Scheme::Rk4)]
    integrator: Scheme,
    /// Longest step of the integration, s; the default is good to 1e-11 rad in half a second of a tumbling iiwa
    #[arg(long, default_value_t = 5e-5)]
    step: f64,
}

#[derive(Clone, Copy, ValueEnum)]
enum Scheme {
    Rk4,
    SemiImplicit,
}

fn main() -> ExitCode {
    exit(run(&Args::parse()))
}

/// The flange, as simulators have it that know no bodies without mass: a millionth of a gram changes the motion by
/// less than 1e-8 rad in half a second, and makes it comparable to more digits than that.
fn flange() -> Inertial {
    Inertial {
        link: "flange".to_owned(),
        mass_kg: 1e-9,
        com_m: DVec3::ZERO,
        inertia_kg_m2: DMat3::from_diagonal(DVec3::splat(1e-12)),
    }
}

fn run(args: &Args) -> anyhow::Result<()> {
    let chain = arms::chain(&args.arm)?;
    let n = chain.joint_count();
    let list = |name: &str, text: Option<&String>| match text {
        Some(text) => numbers(text, n).with_context(|| format!("--{name}")),
        None => Ok(vec![0.0; n]),
    };
    let config = ChainMotionConfig {
        friction: std::iter::zip(
            list("viscous", args.viscous.as_ref())?,
            list("coulomb", args.coulomb.as_ref())?,
        )
        .map(|(viscous_n_m_s_per_rad, coulomb)| JointFriction {
            viscous_n_m_s_per_rad,
            ..JointFriction::coulomb(coulomb)
        })
        .collect(),
        rotor_inertia_kg_m2: list("rotor-inertia", args.rotor_inertia.as_ref())?,
        stops: match args.joint_limits {
            true => chain
                .joints()
                .iter()
                .map(|joint| [joint.limit.min_rad, joint.limit.max_rad])
                .collect(),
            false => Vec::new(),
        },
        integrator: match args.integrator {
            Scheme::Rk4 => Integrator::Rk4,
            Scheme::SemiImplicit => Integrator::SemiImplicit,
        },
    };
    let mut motion = ChainMotion::new(
        ChainDynamics::new(&chain)?.with_payload(&flange())?,
        &list("start", args.start.as_ref())?,
        &list("start-velocity", args.start_velocity.as_ref())?,
        config,
    )?;
    let wrench = match &args.wrench {
        Some(text) => Wrench::from_array(arms::parse_list::<6>(text).context("--wrench")?),
        None => Wrench::default(),
    };
    let torques = match args.gravity_only {
        true => HeldTorques::new(n),
        false => read_torques(&chain, args.saturate)?,
    };
    let sampling = MotionSampling {
        duration_s: args.duration,
        every_s: args.every,
        max_step_s: args.step,
    };

    let mut output = writer(None)?;
    let mut header = vec!["t".to_owned()];
    header.extend(numbered("q", n));
    header.extend(numbered("qd", n));
    header.push("energy_j".to_owned());
    sample_motion(&mut motion, &torques, &wrench, &sampling, |sample| {
        if sample.t_s == 0.0 {
            output.write_record(&header)?;
        }
        let state = sample.q.iter().chain(sample.qd).copied();
        let row = [sample.t_s]
            .into_iter()
            .chain(state)
            .chain([sample.energy_j]);
        anyhow::Ok(output.write_record(to_cells(row))?)
    })?;
    output.flush()?;
    Ok(())
}

/// The rows of standard input; the first may be a header.
fn read_torques(chain: &Chain, saturate: bool) -> anyhow::Result<HeldTorques> {
    let n = chain.joint_count();
    let mut header = vec!["t".to_owned()];
    header.extend(numbered("tau", n));
    let mut held = HeldTorques::new(n);
    let mut first = true;
    for (index, line) in std::io::stdin().lock().lines().enumerate() {
        let place = || format!("standard input line {}", index + 1);
        let line = line.with_context(place)?;
        let text = line.trim_start_matches('\u{feff}').trim();
        if text.is_empty() {
            continue;
        }
        let cells = text.split(',').map(str::trim);
        if std::mem::take(&mut first) && text.starts_with(char::is_alphabetic) {
            let named = cells.eq(header.iter());
            ensure!(
                named,
                "{}: the header must be {}",
                place(),
                header.join(",")
            );
            continue;
        }
        let mut row = numbers(text, n + 1).with_context(place)?;
        if saturate {
            for (torque, joint) in row[1..].iter_mut().zip(chain.joints()) {
                let most = joint.max_effort.unwrap_or(f64::INFINITY);
                *torque = torque.clamp(-most, most);
            }
        }
        held.push(row[0], &row[1..]).with_context(place)?;
    }
    Ok(held)
}

/// So many finite numbers, separated by commas.
fn numbers(text: &str, count: usize) -> anyhow::Result<Vec<f64>> {
    let values = text
        .split(',')
        .map(|cell| {
            let value: Option<f64> = cell.trim().parse().ok().filter(|v: &f64| v.is_finite());
            value.with_context(|| format!("{cell:?} is not a finite number"))
        })
        .collect::<anyhow::Result<Vec<f64>>>()?;
    let got = values.len();
    ensure!(got == count, "{got} numbers, expected {count}");
    Ok(values)
}
