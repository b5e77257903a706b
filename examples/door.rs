//! A push at a door: what does the hand feel, and what should it?
//!
//! `cargo run --release --example door -- --push 20`, or with `--identify` the whole study

use anyhow::{Context, bail, ensure};
use clap::{Parser, ValueEnum};
use hwall_haptics::ObjectRenderingConfig;
use hwall_lab::documents::Destination;
use hwall_lab::feel::push::{Hand, Profile, Push, Trace, run as push};
use hwall_lab::feel::rig::{ArmLevel, Render, Rig, Way};
use hwall_lab::feel::study::{self, Request};
use hwall_lab::feel::subject::of_scene;
use hwall_lab::feel::{document, figures};
use hwall_sim::HandBodyConfig;
use hwall_stage::exit;
use hwall_stage::setting::load_scene;
use hwall_testkit::{MarkdownTable, Timing};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// A simulated hand pushes a door (or panel, drawer, button), an arm renders it: how it moves beside the ideal object under the same force,
/// where the energy goes; writes door.svg. With --identify: stiffness, mass and damping as felt, over a grid; writes FEEL.md.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    destination: Destination,
    /// An OBJ file with its sidecar [default: the built-in room]
    #[arg(long)]
    scene: Option<PathBuf>,
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
    #[arg(long, default_value_t = 10.0)]
    push: f64,
    /// Length, s; the hand pushes for the first third
    #[arg(long, default_value_t = 3.0)]
    seconds: f64,
    /// A given force, or a hand with mass that aims through the door
    #[arg(long, value_enum, default_value = "profile")]
    hand: HandKind,
    /// Seed of the pushes and the sensors' noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The whole study
    #[arg(long, conflicts_with_all = ["scene", "surface", "arm_level", "render"])]
    identify: bool,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum HandKind {
    Profile,
    Body,
}

fn main() -> ExitCode {
    exit(run(&Args::parse()))
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
    let ways: Vec<Way> = Way::ALL
        .into_iter()
        .filter(|way| args.arm_level.is_none_or(|level| way.level == level))
        .filter(|way| args.render.is_none_or(|render| way.render == render))
        .collect();
    if ways.is_empty() {
        bail!("--render impedance needs torques: --arm-level torque");
    }
    let rig = Rig::new()?;
    let (scene, remarks) = load_scene(args.scene.as_deref())?;
    let subject = of_scene(&rig, &scene, args.surface.as_deref())?;
    let documents = args.destination.open("out/door")?;
    let until_s = args.seconds / 3.0;
    let mut lines = Vec::new();
    for way in ways {
        let hand = match args.hand {
            HandKind::Profile => Hand::Profile(Profile {
                mean_n: args.push,
                sines: Vec::new(),
                until_s,
            }),
            HandKind::Body => Hand::Body {
                config: HandBodyConfig::default(),
                depth_m: args.push / HandBodyConfig::default().arm_stiffness_n_per_m + 0.1,
                rise_s: 0.5 * until_s,
                until_s,
            },
        };
        let made = Push {
            way,
            hand,
            seconds: args.seconds,
            seed: args.seed,
            config: ObjectRenderingConfig::default(),
        };
        lines.push((way.name(), push(&rig, &subject, &made)?));
    }
    let path = documents.folder().join("door.svg");
    figures::push(&path, &subject, &lines)?;
    let mut out = io::stdout();
    for remark in remarks {
        writeln!(out, "{remark}")?;
    }
    let place_m = subject.face.position_m();
    writeln!(
        out,
        "{}, pushed at ({:.2}, {:.2}, {:.2}) m; positions in mrad or mm\n\n{}\nwrote {}",
        subject.name,
        place_m.x,
        place_m.y,
        place_m.z,
        table(&lines),
        path.display()
    )
    .context("standard output")
}

fn table(lines: &[(String, Trace)]) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "arm, way",
        "peak force, N",
        "opened",
        "ideal",
        "largest difference",
        "rms",
        "given, J",
        "returned, J",
        "largest joint torque, N m",
        "inertia as rendered",
        "held back, steps",
        "step p50, us",
        "p99, us",
    ]);
    for (name, trace) in lines {
        let most = |f: &dyn Fn(usize) -> f64| (0..trace.samples.len()).map(f).fold(0.0, f64::max);
        let s = &trace.samples;
        let off = |i: usize| 1e3 * (s[i].position - s[i].ideal).abs();
        let squares: f64 = (0..s.len()).map(|i| off(i).powi(2)).sum();
        let gained = |sign: f64| -> f64 {
            s.windows(2)
                .map(|p| (sign * (p[1].given_j - p[0].given_j)).max(0.0))
                .sum()
        };
        let timing = Timing::from_samples_ns(trace.step_ns.clone());
        table.row([
            name.clone(),
            format!("{:.1}", most(&|i| s[i].force_n)),
            format!("{:.1}", 1e3 * most(&|i| s[i].position.abs())),
            format!("{:.1}", 1e3 * most(&|i| s[i].ideal.abs())),
            format!("{:.2}", most(&off)),
            format!("{:.2}", (squares / s.len() as f64).sqrt()),
            format!("{:.3}", gained(1.0)),
            format!("{:.3}", gained(-1.0)),
            format!("{:.1}", most(&|i| s[i].torque_n_m)),
            format!("{:.2}", trace.inertia),
            trace.unreachable.0.to_string(),
            format!("{:.1}", 1e-3 * timing.median_ns),
            format!("{:.1}", 1e-3 * timing.p99_ns),
        ]);
    }
    table
}

fn identify(args: &Args) -> anyhow::Result<()> {
    let documents = args.destination.open("out/feel")?;
    let style = ProgressStyle::with_template("objects {wide_bar} {percent} %")?;
    let bar = ProgressBar::new(1000).with_style(style);
    let request = Request { seed: args.seed };
    let results = study::study(&request, |share| bar.set_position((1e3 * share) as u64))?;
    bar.finish_and_clear();
    let path = document::write(&request, &results, &documents)?;
    let text = document::text(&results);
    writeln!(io::stdout(), "{text}\nwrote {}", path.display()).context("standard output")
}
