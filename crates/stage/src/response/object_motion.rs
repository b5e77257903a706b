//! The motion of an object with one degree of freedom as a table.

use crate::input::numbers::NumberReader;
use crate::recording::words::name_of;
use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use hwall::haptics::{Click, Detent, MovingObject, ObjectConfig, ObjectPath};
use hwall::object_of;
use hwall::scene::Scene;
use std::io::Write;
use std::path::Path;

/// Kind of object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ObjectKind {
    /// Turns about a hinge.
    Door,
    /// Slides.
    Panel,
    /// Slides.
    Drawer,
    /// Slides, and may click.
    Button,
}

/// Options of an object: degrees and metres.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ObjectOptions {
    /// Of a door about its hinge, kg m²
    #[arg(long, allow_hyphen_values = true)]
    pub inertia: Option<f64>,
    /// Of a panel, drawer or button, kg
    #[arg(long, allow_hyphen_values = true)]
    pub mass: Option<f64>,
    /// Spring, N m/rad or N/m
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub stiffness: f64,
    /// Where the spring is relaxed, degrees (door)
    #[arg(long, allow_hyphen_values = true)]
    pub rest_deg: Option<f64>,
    /// Where the spring is relaxed, m (not a door)
    #[arg(long, allow_hyphen_values = true)]
    pub rest_m: Option<f64>,
    /// Damping, N m s/rad or N s/m
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub damping: f64,
    /// Coulomb friction, N m or N
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub friction: f64,
    /// Distance from a door's hinge at which the force acts, at right angles, m [default: 1]
    #[arg(long, allow_hyphen_values = true)]
    pub radius: Option<f64>,
    /// Stops of a door, degrees: lo,hi around zero [default: none]
    #[arg(long, value_parser = numbers::<2>, allow_hyphen_values = true)]
    pub range_deg: Option<[f64; 2]>,
    /// Stops of anything else, m: lo,hi around zero [default: none]
    #[arg(long, value_parser = numbers::<2>, allow_hyphen_values = true)]
    pub range_m: Option<[f64; 2]>,
    /// Share of the speed with which stops throw back, 0 to 1
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub restitution: f64,
    /// A latch: middle,half width,largest pull; deg,deg,N m for a door, m,m,N otherwise; may be repeated
    #[arg(long, value_parser = numbers::<3>, allow_hyphen_values = true)]
    pub detent: Vec<[f64; 3]>,
    /// The click of a button: start,snap,release,force in m,m,m,N
    #[arg(long, value_parser = numbers::<4>, allow_hyphen_values = true)]
    pub click: Option<[f64; 4]>,
}

/// `N` numbers with commas between them; a stop may be infinitely far.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|cell| cell.trim().parse()).collect();
    let numbers = numbers.map_err(|e| format!("{text:?}: {e}"))?;
    numbers
        .try_into()
        .map_err(|_| format!("{text:?} are not {N} numbers"))
}

/// Rows `t,force_n` (s, N held until the next row), with or without that header.
pub struct ForceRows {
    reader: NumberReader,
    places: Vec<usize>,
}

impl ForceRows {
    /// Opens a file, or standard input for `None`.
    ///
    /// # Errors
    /// Input that cannot be read, is empty, or has another header.
    pub fn open(path: Option<&Path>) -> anyhow::Result<Self> {
        let names = ["t", "force_n"];
        let reader = NumberReader::open_or(path, &names)?;
        let places = reader.columns(&names.map(String::from))?;
        Ok(Self { reader, places })
    }
}

/// An object, and how a force acts on it.
#[derive(Debug)]
pub struct PushedObject {
    object: MovingObject,
    turns: bool,
    /// 1 for sliding objects.
    radius_m: f64,
}

impl PushedObject {
    /// The object that options describe.
    ///
    /// # Errors
    /// Options of another kind, a missing inertia, or invalid values.
    pub fn from_options(kind: ObjectKind, options: &ObjectOptions) -> anyhow::Result<Self> {
        Self::new(configured(kind, options)?, kind == ObjectKind::Door)
    }

    /// The object of a surface of a scene.
    ///
    /// # Errors
    /// A scene that cannot be read, or no movable surface of this name.
    pub fn from_scene(path: &Path, name: &str) -> anyhow::Result<Self> {
        let (scene, _) = Scene::from_obj_file(path, None)?;
        let surface = scene
            .find(name)
            .with_context(|| format!("{} has no surface {name:?}", path.display()))?;
        let (config, path) = object_of(&scene, surface)?
            .with_context(|| format!("surface {name:?} does not move"))?;
        Self::new(config, matches!(path, ObjectPath::Turning { .. }))
    }

    fn new(config: ObjectConfig, turns: bool) -> anyhow::Result<Self> {
        let [low, high] = config.range;
        let object = MovingObject::new(config)?;
        ensure!(
            low <= 0.0 && 0.0 <= high,
            "the range must hold zero, where the object starts"
        );
        Ok(Self {
            object,
            turns,
            radius_m: 1.0,
        })
    }

    /// The same door with the force at this distance from its hinge, m.
    ///
    /// # Errors
    /// An object that is not a door, or a distance that is not above zero.
    pub fn with_radius(mut self, radius_m: f64) -> anyhow::Result<Self> {
        if !self.turns {
            bail!("--radius is for doors");
        }
        ensure!(
            radius_m.is_finite() && radius_m > 0.0,
            "--radius is {radius_m}, it must be positive"
        );
        self.radius_m = radius_m;
        Ok(self)
    }

    /// Writes `t,position,velocity` at the time of each row; complete rows even on an error.
    ///
    /// # Errors
    /// No rows, a row that is not two finite numbers with a later time (names the line), or output that cannot be written.
    pub fn write(
        mut self,
        input: &mut ForceRows,
        output: &mut csv::Writer<impl Write>,
    ) -> anyhow::Result<()> {
        output.write_record(["t", "position", "velocity"])?;
        let moved = self.follow(input, output);
        // Also write the rows before an error.
        output.flush()?;
        moved
    }

    fn follow(
        &mut self,
        input: &mut ForceRows,
        output: &mut csv::Writer<impl Write>,
    ) -> anyhow::Result<()> {
        // Time and force of the previous row.
        let mut held = None;
        while let Some(row) = input.reader.next_row()? {
            let place = input.reader.place(&row);
            let [t_s, force_n] = input.reader.values(&row, &input.places)?[..] else {
                bail!("{place}: not two numbers");
            };
            if let Some((since_s, force)) = held {
                let rising = t_s > since_s;
                ensure!(
                    rising,
                    "{place}, column t: {t_s} does not lie after {since_s}"
                );
                self.object.step(force, t_s - since_s).context(place)?;
            }
            held = Some((t_s, force_n * self.radius_m));
            let numbers = [t_s, self.object.position(), self.object.velocity()];
            output.write_record(numbers.map(|v| format!("{v:.16e}")))?;
        }
        ensure!(held.is_some(), "the input has no rows");
        Ok(())
    }
}

fn configured(kind: ObjectKind, options: &ObjectOptions) -> anyhow::Result<ObjectConfig> {
    let door = kind == ObjectKind::Door;
    // Options of the other kinds.
    let others = if door {
        [
            ("mass", options.mass.is_some()),
            ("rest-m", options.rest_m.is_some()),
            ("range-m", options.range_m.is_some()),
        ]
    } else {
        [
            ("inertia", options.inertia.is_some()),
            ("rest-deg", options.rest_deg.is_some()),
            ("range-deg", options.range_deg.is_some()),
        ]
    };
    let name = name_of(kind);
    if let Some((option, _)) = others.iter().find(|(_, given)| *given) {
        bail!("--{option} is not for a {name}");
    }
    ensure!(
        kind == ObjectKind::Button || options.click.is_none(),
        "--click is not for a {name}"
    );
    let (option, inertia) = if door {
        ("inertia", options.inertia)
    } else {
        ("mass", options.mass)
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
        stiffness: options.stiffness,
        rest: scale * options.rest_deg.or(options.rest_m).unwrap_or(0.0),
        damping: options.damping,
        friction: options.friction,
        range: options
            .range_deg
            .or(options.range_m)
            .map_or(free.range, |range| range.map(|v| v * scale)),
        restitution: options.restitution,
        detents: options.detent.iter().map(detent).collect(),
        click: options.click.map(click),
        ..free
    })
}
