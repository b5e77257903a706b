//! Base placement by coverage or by arrival: from flags to files.

use super::arrival_placement;
use super::placement::{self, TargetChoice};
use anyhow::{Context, ensure};
use clap::ValueEnum;
use glam::DVec3;
use hwall_arrival::WaitingConfig;
use hwall_haptics::Board;
use hwall_kinematics::SrsArm;
use hwall_reachability::{Interval, PlacementConfig, Roll, Steps, Target, place_base};
use hwall_stage::arms::{self, NamedArm};
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::input::output::remove_outdated;
use hwall_stage::input::scene_file::SceneFlags;
use hwall_stage::numbers::{counted, whole_within};
use hwall_stage::{note, setting};
use std::f64::consts::TAU;
use std::io::Write;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Instant;

/// Arm, scene and criterion, as flags of a command line.
#[derive(Debug, Clone, clap::Args)]
pub struct PlacementOptions {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneFlags,
    /// Only this surface; may be repeated [default: all touchable surfaces]
    #[arg(long)]
    pub surface: Vec<String>,
    /// Targets between these heights, low,high in metres
    #[arg(long, default_value = "0.4,1.4", allow_hyphen_values = true)]
    pub heights: String,
    /// Distance between targets, m
    #[arg(long, default_value_t = 0.1, allow_negative_numbers = true)]
    pub spacing_m: f64,
    /// Only targets within a circle on the floor: x,y,radius in metres; large scenes need it
    #[arg(long, allow_hyphen_values = true)]
    pub near: Option<String>,
    /// Distance between base positions, m
    #[arg(long, default_value_t = 0.1, allow_negative_numbers = true)]
    pub grid_m: f64,
    /// Number of headings tried, evenly spaced
    #[arg(long, default_value_t = 8, value_parser = whole_within::<1, 360>, allow_negative_numbers = true)]
    pub headings: u64,
    /// Height of the base, m
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub base_height_m: f64,
    /// The base must stand at least this far behind the wall of each target it serves, m; any: on any side, even in the wall
    #[arg(
        long,
        default_value = "0.2",
        value_name = "METRES|any",
        allow_hyphen_values = true
    )]
    pub behind_m: Behind,
    /// Criterion: targets reached, or targets reached in time from the waiting posture of that place, with the board coming from behind the
    /// walls
    #[arg(long, value_enum, default_value = "coverage")]
    pub objective: Objective,
    /// Time from when a target is known to the touch, s (only by arrival) [default: 0.7]
    #[arg(long, allow_negative_numbers = true)]
    pub budget_s: Option<f64>,
    /// Largest distance of the middle of the board from a target, m (only by arrival) [default: 0.055]
    #[arg(long, allow_negative_numbers = true)]
    pub slack_m: Option<f64>,
    /// The arm.
    #[command(flatten)]
    pub arm: NamedArm,
    /// Output folder
    #[arg(long, default_value = "out/placement")]
    pub out: PathBuf,
}

/// Distance of the base behind the walls: at least the radius of the foot, or the arm would be in the wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Behind(pub Option<f64>);

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

/// Criterion for the best place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Objective {
    /// Targets reached
    Coverage,
    /// Targets reached in time
    Arrival,
}

/// A search over all positions from which the arm may reach a target, with the board in quarter turns.
fn search(
    options: &PlacementOptions,
    arm: &SrsArm,
    targets: &[Target],
) -> anyhow::Result<PlacementConfig> {
    let far = DVec3::splat(arm.shoulder_wrist_range().longest_m + 0.2);
    let [low, high] = placement::corners(targets).context("no targets")?;
    let (min, max, headings) = (low - far, high + far, options.headings);
    let steps = |from, to| Steps::spanning(from, to, options.grid_m).context("--grid-m");
    let (x, y) = (steps(min.x, max.x)?, steps(min.y, max.y)?);
    let headings_rad = (0..headings).map(|i| i as f64 * TAU / headings as f64);
    Ok(PlacementConfig {
        headings_rad: headings_rad.collect(),
        roll: Roll::quarter_turns(),
        least_behind_m: options.behind_m.0,
        ..PlacementConfig::new(x, y, options.base_height_m)
    })
}

/// `low,high` in metres.
///
/// # Errors
/// Anything else, or a low above the high.
pub(super) fn heights(text: &str) -> anyhow::Result<Interval> {
    let [low, high] = arms::parse_list::<2>(text).context("--heights")?;
    ensure!(low <= high, "--heights {text}: {low} is above {high}");
    Ok(Interval::new(low, high))
}

/// Output files of coverage, and additional ones of arrival.
const BY_COVERAGE: [&str; 2] = ["placement.svg", "placements.csv"];
const BY_ARRIVAL: [&str; 2] = ["placements_by_arrival.csv", "arrival.svg"];

/// Finds the best places, writes the files and prints the tables. A run by coverage removes arrival files of an earlier
/// run.
///
/// # Errors
/// Invalid flags, a scene without targets within reach, files that cannot be read or written.
pub fn run(options: &PlacementOptions, out: &mut impl Write) -> anyhow::Result<()> {
    let by_arrival = options.objective == Objective::Arrival;
    let names = match by_arrival {
        true => [BY_COVERAGE, BY_ARRIVAL].concat(),
        false => BY_COVERAGE.to_vec(),
    };
    FilePlan::default()
        .read_scene("--scene", options.scene.scene.as_deref())
        .write_into("--out", Some(&options.out), &names)
        .check()?;
    let (budget_s, slack_m) = (options.budget_s, options.slack_m);
    for (flag, value) in [("--budget-s", budget_s), ("--slack-m", slack_m)] {
        ensure!(
            by_arrival || value.is_none(),
            "{flag} says when a touch is in time: it needs --objective arrival"
        );
    }
    let face = Board::default().flange_from_board_face()?;
    let arm = options.arm.closed_form()?.with_tool(face);
    let (scene, remarks) = setting::load_scene(options.scene.file())?;
    for remark in remarks {
        note(remark);
    }
    let heights = heights(&options.heights)?;
    let near = options.near.as_deref().map(arms::parse_list::<3>);
    let choice = TargetChoice {
        surfaces: &options.surface,
        heights,
        spacing_m: options.spacing_m,
        near: near.transpose().context("--near")?,
    };
    let targets = placement::targets(&scene, &choice)?;
    if let Some(remark) = placement::left_out(&scene, &choice) {
        note(remark);
    }
    if let (None, Some(remark)) = (&options.near, placement::too_far_apart(&arm, &targets)) {
        note(remark);
    }
    let config = search(options, &arm, &targets)?;
    let start = Instant::now();
    let scores = place_base(&arm, &targets, &config)?;
    let took = start.elapsed().as_secs_f64();
    std::fs::create_dir_all(&options.out).with_context(|| options.out.display().to_string())?;
    let [figure, table] = BY_COVERAGE.map(|name| options.out.join(name));
    placement::heat_map(&figure, &scene, &targets, &scores)?;
    placement::csv(&table, &scores)?;
    let positions = config.x.count() * config.y.count();
    writeln!(
        out,
        "{}, {}, {}, 4 rolls: {took:.3} s\n\n{}\nwrote placement.svg and placements.csv to {}",
        counted(targets.len(), "target", "targets"),
        counted(positions, "position", "positions"),
        counted(options.headings as usize, "heading", "headings"),
        placement::table(&scores),
        options.out.display()
    )?;
    if by_arrival {
        let waiting = WaitingConfig {
            budget_s: budget_s.unwrap_or(0.7),
            slack_m: slack_m.unwrap_or(0.055),
            ..WaitingConfig::default()
        };
        let report = arrival_placement::run(&arm, &scene, &targets, config, waiting, &options.out)?;
        writeln!(out, "{report}")?;
    } else if options.out.join(BY_ARRIVAL[0]).exists() {
        // An arrival.svg without placements_by_arrival.csv belongs to `arrival_map`.
        if let Some(removed) = remove_outdated(&options.out, &BY_ARRIVAL)? {
            writeln!(out, "{removed}")?;
        }
    }
    Ok(())
}
