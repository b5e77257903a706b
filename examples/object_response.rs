//! How a door, panel, drawer or button moves when it is pushed, row by row.
//!
//! `echo "t,force_n
//! 0,10
//! 0.5,0
//! 2,0" | cargo run --release --example object_response -- --object door --inertia 4.3 --friction 0.5 --radius 0.7`

use anyhow::{Context, bail, ensure};
use clap::{Parser, ValueEnum};
use hwall::object_of;
use hwall_haptics::{Click, Detent, MovingObject, ObjectConfig, ObjectPath};
use hwall_scene::Scene;
use hwall_stage::exit;
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::numbers::{NumberReader, writer};
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
    object: Option<Kind>,
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
    /// Read this CSV file instead of standard input
    #[arg(long = "in")]
    input: Option<PathBuf>,
    /// Write this CSV file instead of standard output
    #[arg(long = "out")]
    output: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Kind {
    Door,
    Panel,
    Drawer,
    Button,
}

fn main() -> ExitCode {
    exit(run(&Args::parse()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    FilePlan::tables(args.input.as_deref(), args.output.as_deref()).check()?;
    let (config, turns) = match args.object {
        Some(kind) => (configured(args, kind)?, kind == Kind::Door),
        None => from_scene(args)?,
    };
    let [low, high] = config.range;
    let mut object = MovingObject::new(config)?;
    ensure!(
        low <= 0.0 && 0.0 <= high,
        "the range must hold zero, where the object starts"
    );
    let radius_m = match args.radius {
        Some(_) if !turns => bail!("--radius is for doors"),
        Some(r) if !(r.is_finite() && r > 0.0) => bail!("--radius is {r}, it must be positive"),
        Some(radius_m) => radius_m,
        None => 1.0,
    };

    let names = ["t", "force_n"];
    let mut input = NumberReader::open_or(args.input.as_deref(), &names)?;
    let places = input.columns(&names.map(String::from))?;
    let mut output = writer(args.output.as_deref())?;
    output.write_record(["t", "position", "velocity"])?;
    // Time and force of the row before.
    let mut held = None;
    while let Some(row) = input.next_row()? {
        let place = input.place(&row);
        let [t_s, force_n] = input.values(&row, &places)?[..] else {
            bail!("{place}: not two numbers");
        };
        if let Some((since_s, force)) = held {
            let rising = t_s > since_s;
            ensure!(
                rising,
                "{place}, column t: {t_s} does not lie after {since_s}"
            );
            object.step(force, t_s - since_s).context(place)?;
        }
        held = Some((t_s, force_n * if turns { radius_m } else { 1.0 }));
        let numbers = [t_s, object.position(), object.velocity()];
        output.write_record(numbers.map(|v| format!("{v:.16e}")))?;
    }
    ensure!(held.is_some(), "the input has no rows");
    output.flush()?;
    Ok(())
}

/// The object that the options describe.
fn configured(args: &Args, kind: Kind) -> anyhow::Result<ObjectConfig> {
    let door = kind == Kind::Door;
    // What the other kinds have instead.
    let others = if door {
        [
            ("mass", args.mass.is_some()),
            ("rest-m", args.rest_m.is_some()),
            ("range-m", args.range_m.is_some()),
        ]
    } else {
        [
            ("inertia", args.inertia.is_some()),
            ("rest-deg", args.rest_deg.is_some()),
            ("range-deg", args.range_deg.is_some()),
        ]
    };
    let name = kind
        .to_possible_value()
        .map_or_else(String::new, |v| v.get_name().to_owned());
    if let Some((option, _)) = others.iter().find(|(_, given)| *given) {
        bail!("--{option} is not for a {name}");
    }
    ensure!(
        kind == Kind::Button || args.click.is_none(),
        "--click is not for a {name}"
    );
    let (option, inertia) = if door {
        ("inertia", args.inertia)
    } else {
        ("mass", args.mass)
    };
    let inertia = inertia.with_context(|| format!("a {name} needs --{option}"))?;
    ensure!(
        inertia.is_finite() && inertia > 0.0,
        "--{option} is {inertia}, it must be positive"
    );
    let scale = if door { 1_f64.to_radians() } else { 1.0 };
    let free = ObjectConfig::new(inertia);
    let detent = |&[position, half_width, force]: &[f64; 3]| Detent {
        position: position * scale,
        half_width: half_width * scale,
        force,
    };
    let click = |[start, snap, release, force]: [f64; 4]| Click {
        start,
        snap,
        release,
        force,
    };
    Ok(ObjectConfig {
        stiffness: args.stiffness,
        rest: scale * args.rest_deg.or(args.rest_m).unwrap_or(0.0),
        damping: args.damping,
        friction: args.friction,
        range: args
            .range_deg
            .or(args.range_m)
            .map_or(free.range, |range| range.map(|v| v * scale)),
        restitution: args.restitution,
        detents: args.detent.iter().map(detent).collect(),
        click: args.click.map(click),
        ..free
    })
}

/// The object that a surface of a scene is, and whether it turns.
fn from_scene(args: &Args) -> anyhow::Result<(ObjectConfig, bool)> {
    let path = args.scene.as_deref().context("--object or --scene")?;
    let name = args.surface.as_deref().context("--surface")?;
    let (scene, _) = Scene::from_obj_file(path, None)?;
    let surface = scene
        .find(name)
        .with_context(|| format!("{} has no surface {name:?}", path.display()))?;
    let (config, path) =
        object_of(&scene, surface)?.with_context(|| format!("surface {name:?} does not move"))?;
    Ok((config, matches!(path, ObjectPath::Turning { .. })))
}

/// `N` numbers with commas between them.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|cell| cell.trim().parse()).collect();
    let numbers = numbers.map_err(|e| format!("{text:?}: {e}"))?;
    numbers
        .try_into()
        .map_err(|_| format!("{text:?} are not {N} numbers"))
}
