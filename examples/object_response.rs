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
    /// Of a door about its hinge, kg m²
    #[arg(long, allow_hyphen_values = true)]
    inertia: Option<f64>,
    /// Of a panel, drawer or button, kg
    #[arg(long, allow_hyphen_values = true)]
    mass: Option<f64>,
    /// Spring, N m/rad or N/m
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    stiffness: f64,
    /// Where the spring is relaxed, degrees (door)
    #[arg(long, allow_hyphen_values = true)]
    rest_deg: Option<f64>,
    /// Where the spring is relaxed, m (not a door)
    #[arg(long, allow_hyphen_values = true)]
    rest_m: Option<f64>,
    /// Damping, N m s/rad or N s/m
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    damping: f64,
    /// Coulomb friction, N m or N
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    friction: f64,
    /// Distance from a door's hinge at which the force acts, at right angles, m [default: 1]
    #[arg(long, allow_hyphen_values = true)]
    radius: Option<f64>,
    /// Stops of a door, degrees: lo,hi around zero [default: none]
    #[arg(long, value_parser = numbers::<2>, allow_hyphen_values = true)]
    range_deg: Option<[f64; 2]>,
    /// Stops of anything else, m: lo,hi around zero [default: none]
    #[arg(long, value_parser = numbers::<2>, allow_hyphen_values = true)]
    range_m: Option<[f64; 2]>,
    /// Share of the speed with which stops throw back, 0 to 1
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    restitution: f64,
    /// A latch: middle,half width,largest pull; deg,deg,N m for a door, m,m,N otherwise; may be repeated
    #[arg(long, value_parser = numbers::<3>, allow_hyphen_values = true)]
    detent: Vec<[f64; 3]>,
    /// The click of a button: start,snap,release,force in m,m,m,N
    #[arg(long, value_parser = numbers::<4>, allow_hyphen_values = true)]
    click: Option<[f64; 4]>,
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
        Some(kind) => PushedObject::from_options(kind, &options(args))?,
        None => PushedObject::from_scene(
            args.scene.as_deref().context("--object or --scene")?,
            args.surface.as_deref().context("--surface")?,
        )?,
    };
    let object = match args.radius {
        Some(radius_m) => object.with_radius(radius_m)?,
        None => object,
    };
    let mut input = ForceRows::open(args.files.input().path())?;
    let output = args.files.writer()?;
    output.fill(|rows| object.write(&mut input, rows))
}

fn options(args: &Args) -> ObjectOptions<'_> {
    ObjectOptions {
        inertia: args.inertia,
        mass: args.mass,
        stiffness: args.stiffness,
        rest_deg: args.rest_deg,
        rest_m: args.rest_m,
        damping: args.damping,
        friction: args.friction,
        range_deg: args.range_deg,
        range_m: args.range_m,
        restitution: args.restitution,
        detents: &args.detent,
        click: args.click,
    }
}

/// `N` numbers with commas between them.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|cell| cell.trim().parse()).collect();
    let numbers = numbers.map_err(|e| format!("{text:?}: {e}"))?;
    numbers
        .try_into()
        .map_err(|_| format!("{text:?} are not {N} numbers"))
}
