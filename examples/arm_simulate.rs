//! Motion of an arm under gravity, joint torques and a wrench at the flange.
//!
//! `cargo run --release --example arm_simulate -- --start 0,0.5,0,-1.2,0,0.8,0 --gravity-only --duration 0.5`

use anyhow::Context;
use clap::{Parser, ValueEnum};
use hwall_kinematics::Wrench;
use hwall_sim::{
    ChainMotion, ChainMotionConfig, HeldTorques, Integrator, JointFriction, MotionSampling,
};
use hwall_stage::arms::{self, NamedArm};
use hwall_stage::exit;
use hwall_stage::numbers::{TableFiles, list, positive};
use hwall_stage::response::arm_motion::{ArmMotion, bodies};
use hwall_stage::response::torque_rows;
use std::process::ExitCode;

/// Motion of rigid links under gravity, torques and a wrench.
///
/// In: CSV rows t,tau1..tau7 (s, N m), with or without that header; each row's torques hold until the time
/// of the next row, before the first row they are zero. Out: CSV t,q1..q7,qd1..qd7,energy_j (s, rad, rad/s, J; potential
/// energy zero for a mass at the base origin) at 0, every, 2 every ... and at the duration. No friction, rotor inertia, joint
/// limits or saturation unless asked for. An arm with n joints has n columns and values instead of seven.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    arm: NamedArm,
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
    /// No torques: nothing is read
    #[arg(long, conflicts_with_all = ["input", "table"])]
    gravity_only: bool,
    /// Length of the motion, s
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true, value_parser = positive)]
    duration: f64,
    /// Time between rows of the output, s
    #[arg(long, default_value_t = 0.01, allow_negative_numbers = true, value_parser = positive)]
    every: f64,
    /// How to integrate
    #[arg(long, value_enum, default_value_t = Scheme::Rk4)]
    integrator: Scheme,
    /// Longest step of the integration, s; the default is good to 1e-11 rad in half a second of a tumbling iiwa
    #[arg(long, default_value_t = 5e-5, allow_negative_numbers = true, value_parser = positive)]
    step: f64,
    #[command(flatten)]
    files: TableFiles,
}

#[derive(Clone, Copy, ValueEnum)]
enum Scheme {
    Rk4,
    SemiImplicit,
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
    let values = |name: &str, text: &Option<String>| match text {
        Some(text) => list(text, n).with_context(|| format!("--{name}")),
        None => Ok(vec![0.0; n]),
    };
    let viscous = values("viscous", &args.viscous)?;
    let coulomb = values("coulomb", &args.coulomb)?;
    let stops = chain
        .joints()
        .iter()
        .map(|joint| [joint.limit.min_rad, joint.limit.max_rad]);
    let config = ChainMotionConfig {
        friction: std::iter::zip(viscous, coulomb)
            .map(|(viscous_n_m_s_per_rad, coulomb)| JointFriction {
                viscous_n_m_s_per_rad,
                ..JointFriction::coulomb(coulomb)
            })
            .collect(),
        rotor_inertia_kg_m2: values("rotor-inertia", &args.rotor_inertia)?,
        stops: stops.filter(|_| args.joint_limits).collect(),
        integrator: match args.integrator {
            Scheme::Rk4 => Integrator::Rk4,
            Scheme::SemiImplicit => Integrator::SemiImplicit,
        },
    };
    let start = values("start", &args.start)?;
    let start_velocity = values("start-velocity", &args.start_velocity)?;
    let motion = ArmMotion {
        motion: ChainMotion::new(bodies(&chain)?, &start, &start_velocity, config)?,
        wrench: match &args.wrench {
            Some(text) => Wrench::from_array(arms::parse_list::<6>(text).context("--wrench")?),
            None => Wrench::default(),
        },
        sampling: MotionSampling {
            duration_s: args.duration,
            every_s: args.every,
            max_step_s: args.step,
        },
    };
    let torques = match args.gravity_only {
        true => HeldTorques::new(n),
        false => {
            let (name, table) = args.files.input().open()?;
            torque_rows::read(table, &name, &chain, args.saturate)?
        }
    };
    args.files
        .writer()?
        .fill(|rows| motion.write(&torques, rows))
}
