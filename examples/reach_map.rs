//! Per-plane reachability maps: exact intervals of every line of some walls, or what optimization finds.
//!
//! `cargo run --release --example reach_map -- --published`

use anyhow::Context;
use clap::Parser;
use hwall_lab::reach::in_space::InSpaceArgs;
use hwall_lab::reach::maps::{self, Grid, Request};
use hwall_lab::reach::{orientation_rows, published};
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::{exit, numbers};
use std::path::PathBuf;
use std::process::ExitCode;

/// Where on vertical walls can the arm hold its flange, facing outwards?
///
/// Writes CSV: orientation,plane,height,y_lo_mm,y_hi_mm, one row an interval; orientation counts
/// from 1, plane and height from 0; y is the base frame's y of the end, mm, which tells little about
/// walls beside the arm: --map-csv holds the places along the wall. Prints a summary on standard
/// error.
#[derive(Parser)]
struct Args {
    /// Solve the grid of the files published with the 2018 paper [default: the dissertation's grid]
    #[arg(long, conflicts_with_all = ["orientations", "planes", "heights"])]
    published: bool,
    /// Headings of the walls' normals in degrees, counter-clockwise from the base's x axis: a,b,... or from:to:step [default: -45:45:15]
    #[arg(long, allow_hyphen_values = true)]
    orientations: Option<String>,
    /// Distances of the planes along their normal, m: a value or from:to:step, the step always positive [default: 0.926:-0.924:0.05]
    #[arg(long, allow_hyphen_values = true)]
    planes: Option<String>,
    /// Heights above the base, m: a value or from:to:step [default: -0.26:1.24:0.05]
    #[arg(long, allow_hyphen_values = true)]
    heights: Option<String>,
    #[command(flatten)]
    request: Request,
    /// Compare with the published files ori_1.txt .. ori_7.txt in this folder (needs --published)
    #[arg(long, requires = "published")]
    compare: Option<PathBuf>,
    /// Write the CSV here instead of to standard output
    #[arg(long)]
    out: Option<PathBuf>,
    /// Folder for figures: the planes of each orientation, and the comparison
    #[arg(long)]
    figures: Option<PathBuf>,
    #[command(flatten)]
    in_space: InSpaceArgs,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let mut files = FilePlan::default().read_arm("--arm", &args.request.arm.name);
    for (flag, path) in [
        ("--out", &args.out),
        ("--map-csv", &args.request.map_csv),
        ("--save", &args.request.save),
        ("--exr", &args.request.exr),
        ("--html", &args.in_space.html),
        ("--svg-3d", &args.in_space.svg_3d),
    ] {
        files = files.write(flag, path.as_deref());
    }
    files.check()?;
    let published = args.compare.as_deref().map(published::read).transpose()?;
    let grid = if args.published {
        published::grids()?
    } else {
        let text =
            |text: &Option<String>, default: &str| text.clone().unwrap_or(default.to_owned());
        Grid {
            orientations: &text(&args.orientations, "-45:45:15"),
            planes: &text(&args.planes, "0.926:-0.924:0.05"),
            heights: &text(&args.heights, "-0.26:1.24:0.05"),
        }
        .parse()?
    };
    // Checked before the work.
    let shown = (published.as_ref())
        .map(|published| args.in_space.orientation(published.len()))
        .transpose()?;
    let solved = maps::solve(&args.request, &grid)?;
    let mut output = numbers::output(args.out.as_deref())?;
    published::write_rows(&solved.rows, &mut output).context("writing the intervals")?;
    output.finish()?;
    let comparisons = published
        .as_ref()
        .map(|p| published::compare(&solved.rows, p));
    if let Some(folder) = &args.figures {
        maps::draw(folder, &grid, &solved, comparisons.as_deref())?;
    }
    args.in_space.write(&grid, &solved.along)?;
    eprint!("{}", maps::summary(&solved, comparisons.as_deref()));
    if let (Some(published), Some(shown)) = (&published, shown) {
        let rows = orientation_rows::orientation_rows(published, shown)?;
        eprint!("\nori_{shown}:\n{}", orientation_rows::table(&rows));
    }
    Ok(())
}
