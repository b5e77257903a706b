//! How soon the arm can present its board at every place of a scene's walls, and where it should wait.
//!
//! `cargo run --release --example arrival_map`

use anyhow::Context;
use clap::Parser;
use hwall_arrival::reachability::{WallMaps, WallMapsConfig};
use hwall_arrival::{
    Atlas, AtlasConfig, Surfaces, WaitingConfig, judge_posture, targets_of_maps, waiting_posture,
};
use hwall_haptics::Board;
use hwall_lab::reach::arrival::{self, TouchTexts};
use hwall_lab::reach::arrival_figure::{self, ArrivalFigure};
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::input::floor_pose::FloorPose;
use hwall_stage::numbers::counted;
use hwall_stage::{arms, exit, note, setting};
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Arrival times over the walls of a scene.
///
/// Finds the waiting posture for the places that people touch, chooses a configuration for every place of the walls, and
/// prints how soon these are reached; writes arrival.svg. Base frame of the arm, metres, z up.
#[derive(Parser)]
struct Args {
    /// OBJ scene [default: the built-in room]
    #[arg(long)]
    scene: Option<PathBuf>,
    /// The arm's base in the scene: x,y,z,yaw in metres and degrees
    #[arg(long, allow_hyphen_values = true)]
    base: Option<String>,
    /// People touch between these heights above the base, low,high in metres
    #[arg(long, default_value = "0.15,1.3", allow_hyphen_values = true)]
    heights: String,
    /// People touch within a ball: x,y,z,radius in metres [default: anywhere]
    #[arg(long, allow_hyphen_values = true)]
    near: Option<String>,
    /// Touches in proportion to the walls' areas, instead of equally many on each wall
    #[arg(long)]
    by_area: bool,
    /// The middle of the board may be this far from the place touched, m
    #[arg(long, default_value_t = 0.055, allow_negative_numbers = true)]
    slack_m: f64,
    /// Time from when a target is known to the touch, s
    #[arg(long, default_value_t = 0.7, allow_negative_numbers = true)]
    budget_s: f64,
    /// Wait here instead: seven joints in degrees
    #[arg(long, allow_hyphen_values = true)]
    waiting: Option<String>,
    /// Judge this posture too: seven joints in degrees
    #[arg(long, allow_hyphen_values = true)]
    beside: Option<String>,
    /// iiwa7 or iiwa14
    #[arg(long, default_value = "iiwa7")]
    arm: String,
    /// Save the atlas as a file that the library loads
    #[arg(long)]
    save: Option<PathBuf>,
    /// Output folder
    #[arg(long, default_value = "out/arrival")]
    out: PathBuf,
}

fn main() -> ExitCode {
    exit(run(&Args::parse()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    FilePlan::default()
        .read_scene("--scene", args.scene.as_deref())
        .write_into("--out", Some(&args.out), &["arrival.svg"])
        .write("--save", args.save.as_deref())
        .check()?;
    let board = Board::default();
    let arm = arms::closed_form(&args.arm)?.with_tool(board.flange_from_board_face()?);
    let base = args.base.as_deref().map(FloorPose::parse).transpose()?;
    let (scene, remarks) = setting::load_scene(args.scene.as_deref())?;
    let scene = arrival::in_base(&scene, base.unwrap_or(FloorPose::ORIGIN))?;
    for remark in remarks {
        note(remark);
    }
    let touches = TouchTexts {
        heights: &args.heights,
        near: args.near.as_deref(),
        spacing_m: 0.1,
        by_area: args.by_area,
    };
    let config = WaitingConfig {
        budget_s: args.budget_s,
        slack_m: args.slack_m,
        ..WaitingConfig::default()
    };
    let maps = WallMaps::build(&arm, &arrival::facets(&scene), WallMapsConfig::default())?;
    arrival::check_maps(&maps)?;
    let limits = MotionLimits::of_arm(&arm, &MotionConfig::default())?;
    let targets = targets_of_maps(&maps, &touches.parse()?)?;
    let surfaces = Surfaces::from_maps(&maps, config.clearance.margin_m)?;
    let extent = arrival::extent(&board);
    let start = Instant::now();
    let waiting = match &args.waiting {
        Some(text) => arrival::configuration(text).context("--waiting")?,
        None => waiting_posture(&arm, &targets, &surfaces, extent, &limits, &config)?.q,
    };
    let waiting_took = start.elapsed().as_secs_f64();
    let judged = |q| judge_posture(q, &arm, &targets, &surfaces, extent, &limits, &config);
    let mut postures = vec![("waiting", judged(&waiting)?)];
    if let Some(text) = &args.beside {
        let q = arrival::configuration(text).context("--beside")?;
        postures.push(("beside", judged(&q)?));
    }
    let start = Instant::now();
    let atlas = Atlas::build(
        &arm,
        &maps,
        extent,
        &limits,
        &waiting,
        &AtlasConfig::default(),
    )?;
    let atlas_took = start.elapsed().as_secs_f64();
    let (plain, slack) = (
        arrival::time_look_ups(&atlas, None).median_ns,
        arrival::time_look_ups(&atlas, Some(args.slack_m)).median_ns,
    );
    let walls = arrival::named_walls(&scene, &atlas);
    std::fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    let figure = ArrivalFigure {
        walls: &walls,
        budget_s: args.budget_s,
        waiting: &format!("waiting at {} degrees", arrival::degrees(&waiting)),
    };
    arrival_figure::draw(&args.out.join("arrival.svg"), &figure)?;
    if let Some(path) = &args.save {
        atlas.save(path)?;
    }
    writeln!(
        io::stdout(),
        "{}, slack {} m, budget {} s; waiting posture: {waiting_took:.2} s\n\n{}\natlas: {} nodes, {} bytes, {atlas_took:.3} s; look-up {plain:.0} ns, with slack {slack:.0} ns\n\n{}\nwrote arrival.svg to {}",
        counted(targets.len(), "target", "targets"),
        args.slack_m,
        args.budget_s,
        arrival::posture_table(&postures),
        atlas.nodes().count(),
        atlas.to_bytes().len(),
        arrival::wall_table(&walls),
        args.out.display()
    )?;
    Ok(())
}
