//! Where to place an arm so that it reaches the walls of a scene.
//!
//! `cargo run --release --example base_placement`

use anyhow::Context;
use clap::{Parser, ValueEnum};
use hwall_haptics::Board;
use hwall_lab::reach::arrival_placement::{self, ByArrival};
use hwall_lab::reach::placement::{self, Search, TargetChoice};
use hwall_reachability::{Interval, place_base};
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::numbers::counted;
use hwall_stage::{arms, exit, note, printed, setting};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;
use std::time::Instant;

/// Scores base positions and headings by how many points of the walls the board reaches, or reaches in time.
///
/// Prints the best placements; writes placement.svg (heat map) and placements.csv, by arrival also
/// placements_by_arrival.csv and arrival.svg. All coordinates are those of the scene, metres, z up.
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
    #[arg(long, default_value_t = 0.1, allow_negative_numbers = true)]
    spacing_m: f64,
    /// Only targets within a circle on the floor: x,y,radius in metres; large scenes need it
    #[arg(long, allow_hyphen_values = true)]
    near: Option<String>,
    /// Distance between base positions, m
    #[arg(long, default_value_t = 0.1, allow_negative_numbers = true)]
    grid_m: f64,
    /// Headings tried, evenly round the circle
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..=360))]
    headings: u64,
    /// Height of the base, m
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    base_height_m: f64,
    /// The base must stand at least this far behind the wall of each target it serves, m; any: on any side, even in the wall
    #[arg(
        long,
        default_value = "0.2",
        value_name = "METRES|any",
        allow_hyphen_values = true
    )]
    behind_m: Behind,
    /// What the best place is best in: targets reached, or targets reached in time from a waiting posture of its own, with
    /// the board coming from behind the walls
    #[arg(long, value_enum, default_value = "coverage")]
    objective: Objective,
    /// Time from when a target is known to the touch, s (only by arrival) [default: 0.7]
    #[arg(long, allow_negative_numbers = true)]
    budget_s: Option<f64>,
    /// The middle of the board may be this far from a target, m (only by arrival) [default: 0.055]
    #[arg(long, allow_negative_numbers = true)]
    slack_m: Option<f64>,
    /// iiwa7 or iiwa14
    #[arg(long, default_value = "iiwa7")]
    arm: String,
    /// Output folder
    #[arg(long, default_value = "out/placement")]
    out: PathBuf,
}

/// How far the base stands behind the walls: at least the radius of the foot, or the arm would stand in the wall.
#[derive(Clone, Copy)]
struct Behind(Option<f64>);

impl FromStr for Behind {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "any" {
            return Ok(Self(None));
        }
        let distance_m = text.parse().ok().filter(|m: &f64| m.is_finite());
        let distance_m = distance_m.ok_or("neither a finite number nor any")?;
        Ok(Self(Some(distance_m)))
    }
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Objective {
    Coverage,
    Arrival,
}

impl Objective {
    fn files(self) -> &'static [&'static str] {
        let all = &[
            "placement.svg",
            "placements.csv",
            "placements_by_arrival.csv",
            "arrival.svg",
        ];
        match self {
            Self::Coverage => &all[..2],
            Self::Arrival => all,
        }
    }
}

fn main() -> ExitCode {
    let args = Args::parse();
    exit(printed(|out| run(&args, out)))
}

fn run(args: &Args, out: &mut impl Write) -> anyhow::Result<()> {
    FilePlan::default()
        .read_scene("--scene", args.scene.as_deref())
        .write_into("--out", Some(&args.out), args.objective.files())
        .check()?;
    if args.objective == Objective::Coverage {
        for (flag, value) in [("--budget-s", args.budget_s), ("--slack-m", args.slack_m)] {
            anyhow::ensure!(
                value.is_none(),
                "{flag} says when a touch is in time: it needs --objective arrival"
            );
        }
    }
    let arm = arms::closed_form(&args.arm)?.with_tool(Board::default().flange_from_board_face()?);
    let (scene, remarks) = setting::load_scene(args.scene.as_deref())?;
    for remark in remarks {
        note(remark);
    }
    let [low, high] = arms::parse_list::<2>(&args.heights).context("--heights")?;
    anyhow::ensure!(
        low <= high,
        "--heights {}: {low} is above {high}",
        args.heights
    );
    let near = args.near.as_deref().map(arms::parse_list::<3>);
    let choice = TargetChoice {
        surfaces: &args.surface,
        heights: Interval::new(low, high),
        spacing_m: args.spacing_m,
        near: near.transpose().context("--near")?,
    };
    let targets = placement::targets(&scene, &choice)?;
    if let Some(remark) = placement::left_out(&scene, &choice) {
        note(remark);
    }
    if let (None, Some(remark)) = (&args.near, placement::too_far_apart(&arm, &targets)) {
        note(remark);
    }
    let search = Search {
        grid_m: args.grid_m,
        headings: args.headings,
        base_height_m: args.base_height_m,
        least_behind_m: args.behind_m.0,
    };
    let config = placement::config(&arm, &targets, &search)?;
    let start = Instant::now();
    let scores = place_base(&arm, &targets, &config)?;
    let took = start.elapsed().as_secs_f64();
    std::fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    placement::heat_map(&args.out.join("placement.svg"), &scene, &targets, &scores)?;
    placement::csv(&args.out.join("placements.csv"), &scores)?;
    let positions = config.x.count() * config.y.count();
    writeln!(
        out,
        "{}, {}, {}, 4 rolls: {took:.3} s\n\n{}\nwrote placement.svg and placements.csv to {}",
        counted(targets.len(), "target", "targets"),
        counted(positions, "position", "positions"),
        counted(args.headings as usize, "heading", "headings"),
        placement::table(&scores),
        args.out.display()
    )?;
    if args.objective == Objective::Arrival {
        let by_arrival = ByArrival {
            arm: &arm,
            scene: &scene,
            targets: &targets,
            config: &config,
            budget_s: args.budget_s.unwrap_or(0.7),
            slack_m: args.slack_m.unwrap_or(0.055),
        };
        let report = arrival_placement::run(&by_arrival, &args.out)?;
        writeln!(out, "{report}")?;
    }
    Ok(())
}
