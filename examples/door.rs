//! A push at a door: what does the hand feel, and what should it?
//!
//! `cargo run --release --example door -- --push 20`, or with `--identify` the whole study

use anyhow::{Context, bail, ensure};
use clap::Parser;
use hwall_lab::documents::{Destination, bar, show};
use hwall_lab::feel::document;
use hwall_lab::feel::rig::{Render, Rig, Way};
use hwall_lab::feel::single::{HandKind, SinglePush, report};
use hwall_lab::feel::study;
use hwall_lab::feel::subject::of_scene;
use hwall_stage::exit;
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::input::scene_file::SceneFlags;
use hwall_stage::run::simulated_arm::ArmLevel;
use hwall_stage::setting::load_scene;
use std::io::{self, Write};
use std::process::ExitCode;

/// A simulated hand pushes a door (or panel, drawer, button), an arm renders it: how it moves beside the ideal object under the same force,
/// where the energy goes; writes door.svg. With --identify: stiffness, mass and damping as felt, over a grid; writes FEEL.md.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    #[command(flatten)]
    scene: SceneFlags,
    /// The surface that is pushed [default: the first door that the arm can hold the board on]
    #[arg(long)]
    surface: Option<String>,
    /// What of the arm is simulated [default: both]
    #[arg(long, value_enum)]
    arm_level: Option<ArmLevel>,
    /// How the arm is driven [default: both, where the level allows]
    #[arg(long, value_enum)]
    render: Option<Render>,
    /// Peak force, N
    #[arg(long, default_value_t = 10.0, allow_negative_numbers = true)]
    push: f64,
    /// Length, s; the hand pushes for the first third
    #[arg(long, default_value_t = 3.0, allow_negative_numbers = true)]
    seconds: f64,
    /// A given force, or a hand with mass that aims through the door
    #[arg(long, value_enum, default_value = "profile")]
    hand: HandKind,
    /// Seed of the pushes and the sensors' noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// The whole study
    #[arg(long, conflicts_with_all = ["scene", "surface", "arm_level", "render"])]
    identify: bool,
}

/// Of one push.
const OUT: &str = "out/door";
const FIGURE: &str = "door.svg";

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    if args.identify {
        return identify(args);
    }
    ensure!(
        args.push > 0.0 && args.push <= 140.0,
        "--push is {}, it must be above 0 and at most 140",
        args.push
    );
    ensure!(
        args.seconds > 0.0 && args.seconds <= 600.0,
        "--seconds is {}, it must be above 0 and at most 600",
        args.seconds
    );
    let ways = Way::matching(args.arm_level, args.render);
    if ways.is_empty() {
        bail!("--render impedance needs torques: --arm-level torque");
    }
    FilePlan::default()
        .read_scene("--scene", args.scene.scene.as_deref())
        .write_into("--out", Some(args.destination.folder(OUT)), &[FIGURE])
        .check()?;
    let rig = Rig::new()?;
    let (scene, remarks) = load_scene(args.scene.file())?;
    let subject = of_scene(&rig, &scene, args.surface.as_deref())?;
    let documents = args.destination.open(OUT)?;
    let push = SinglePush {
        hand: args.hand,
        force_n: args.push,
        seconds: args.seconds,
        seed: args.seed,
    };
    let lines = push.run(&rig, &subject, &ways)?;
    let text = report(&documents.folder().join(FIGURE), &subject, &lines)?;
    let mut out = io::stdout();
    for remark in remarks {
        writeln!(out, "{remark}")?;
    }
    writeln!(out, "{text}").context("standard output")
}

fn identify(args: &Args) -> anyhow::Result<()> {
    let documents = args.destination.open("out/feel")?;
    let bar = bar("objects {wide_bar} {percent} %", 1000);
    let results = study::run(args.seed, |share| bar.set_position((1e3 * share) as u64))?;
    bar.finish_and_clear();
    let path = document::write(args.seed, &results, &documents)?;
    let text = document::text(&results)?;
    show(text, &path)
}
