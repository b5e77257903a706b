//! How a door, panel, drawer or button moves when it is pushed, row by row.
//!
//! `echo "t,force_n
//! 0,10
//! 0.5,0
//! 2,0" | cargo run --release --example object_response -- --object door --inertia 4.3 --friction 0.5 --radius 0.7`

use anyhow::Context;
use clap::Parser;
use hwall_stage::exit;
use hwall_stage::numbers::TableFiles;
use hwall_stage::response::object_motion::{ForceRows, ObjectKind, ObjectOptions, PushedObject};
use std::path::PathBuf;
use std::process::ExitCode;

/// Motion of an object with one degree of freedom under forces that are held from row to row.
///
/// In: CSV, columns t (s, rising) and force_n (N, held until the next row), with or without a header line. Out:
/// t,position,velocity (rad and rad/s for a door, otherwise m and m/s) at the time of each row; the object starts at rest at zero
/// at the first. Exact for any distance of the rows.
#[derive(Parser)]
struct Args {
    /// What moves; or --scene and --surface
    #[arg(long, value_enum, required_unless_present = "scene")]
    object: Option<ObjectKind>,
    #[command(flatten)]
    options: ObjectOptions,
    /// An OBJ file with its sidecar, whose surface moves
    #[arg(long, requires = "surface", conflicts_with_all = ["object", "inertia", "mass", "stiffness", "rest_deg", "rest_m",
        "damping", "friction", "range_deg", "range_m", "restitution", "detent", "click"])]
    scene: Option<PathBuf>,
    /// The surface of the scene
    #[arg(long, requires = "scene")]
    surface: Option<String>,
    #[command(flatten)]
    files: TableFiles,
}

fn main() -> ExitCode {
    exit(run(&hwall_stage::arguments::<Args>()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let files = args.files.plan();
    files.read_scene("--scene", args.scene.as_deref()).check()?;
    let object = match args.object {
        Some(kind) => PushedObject::from_options(kind, &args.options)?,
        None => PushedObject::from_scene(
            args.scene.as_deref().context("--object or --scene")?,
            args.surface.as_deref().context("--surface")?,
        )?,
    };
    let object = match args.options.radius {
        Some(radius_m) => object.with_radius(radius_m)?,
        None => object,
    };
    let mut input = ForceRows::open(args.files.input().path())?;
    let output = args.files.writer()?;
    output.fill(|rows| object.write(&mut input, rows))
}
