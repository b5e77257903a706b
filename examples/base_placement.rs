//! Where to stand an arm so that it reaches the walls of a scene.
//!
//! `cargo run --release --example base_placement`

use anyhow::Context;
use clap::Parser;
use glam::DVec3;
use hwall_haptics::Board;
use hwall_lab::reach::placement::{Wanted, csv, heat_map, table, targets};
use hwall_reachability::{Interval, PlacementConfig, Roll, Steps, place_base};
use hwall_stage::arms;
use hwall_stage::exit;
use hwall_stage::stage;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Scores base positions and headings by how many points of the walls the board reaches.
///
/// Prints the best placements; writes placement.svg (heat map) and placements.csv. All
/// coordinates are those of the scene, metres, z up.
#[derive(Parser)]
struct Args {
    /// OBJ scene [default: the built-in room]
    #[arg(long)]
    scene: Option<PathBuf>,
    /// Only this surface; may be repeated [default: all that can be touched]
    #[arg(long)]
    surface: Vec<String>,
    /// Targets between these heights, low,high in metres
    #[arg(long, default_value = "0.4,1.4", allow_hyphen_values = true)]
    heights: String,
    /// Distance between targets, m
    #[arg(long, default_value_t = 0.1)]
    spacing_m: f64,
    /// Only targets within a distance of a place: x,y,radius in metres; large scenes need it
    #[arg(long, allow_hyphen_values = true)]
    near: Option<String>,
    /// Distance between base positions, m
    #[arg(long, default_value_t = 0.1)]
    grid_m: f64,
    /// Headings tried, evenly round the circle
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..=360))]
    headings: u64,
    /// Height of the base, m
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    base_height_m: f64,
    /// The base must stand at least this far behind the wall of each target it serves, m [default: not set, any side will do]
    #[arg(long, allow_hyphen_values = true)]
    behind_m: Option<f64>,
    /// iiwa7 or iiwa14
    #[arg(long, default_value = "iiwa7")]
    arm: String,
    /// Output folder
    #[arg(long, default_value = "out/placement")]
    out: PathBuf,
}

fn main() -> ExitCode {
    exit(run(&Args::parse()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let arm = arms::closed_form(&args.arm)?.with_tool(Board::default().flange_from_board_face()?);
    let (scene, remarks) = stage::load_scene(args.scene.as_deref())?;
    for remark in remarks {
        eprintln!("{remark}");
    }
    let [low, high] = arms::parse_list::<2>(&args.heights).context("--heights")?;
    anyhow::ensure!(
        low <= high,
        "--heights {}: {low} is above {high}",
        args.heights
    );
    let near = args.near.as_deref().map(arms::parse_list::<3>);
    let wanted = Wanted {
        surfaces: &args.surface,
        heights: Interval::new(low, high),
        spacing_m: args.spacing_m,
        near: near.transpose().context("--near")?,
    };
    let targets = targets(&scene, &wanted)?;
    let reach = DVec3::splat(arm.shoulder_wrist_range().longest_m + 0.2);
    let corner = |pick: fn(DVec3, DVec3) -> DVec3| targets.iter().map(|t| t.point_m).reduce(pick);
    let min = corner(DVec3::min).context("no targets")? - reach;
    let max = corner(DVec3::max).context("no targets")? + reach;
    let headings =
        (0..args.headings).map(|i| i as f64 * std::f64::consts::TAU / args.headings as f64);
    let config = PlacementConfig {
        headings_rad: headings.collect(),
        roll: Roll::quarter_turns(),
        least_behind_m: args.behind_m,
        ..PlacementConfig::new(
            Steps::spanning(min.x, max.x, args.grid_m).context("--grid-m")?,
            Steps::spanning(min.y, max.y, args.grid_m).context("--grid-m")?,
            args.base_height_m,
        )
    };
    let start = Instant::now();
    let scores = place_base(&arm, &targets, &config)?;
    let took = start.elapsed().as_secs_f64();
    std::fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    heat_map(&args.out.join("placement.svg"), &scene, &targets, &scores)?;
    csv(&args.out.join("placements.csv"), &scores)?;
    let positions = config.x.count() * config.y.count();
    writeln!(
        io::stdout(),
        "{} targets, {positions} positions, {} headings, 4 rolls: {took:.3} s\n\n{}\nwrote placement.svg and placements.csv to {}",
        targets.len(),
        args.headings,
        table(&scores),
        args.out.display()
    )?;
    Ok(())
}
