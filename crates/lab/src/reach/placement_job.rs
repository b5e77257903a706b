//! Base placement by coverage or by arrival: from flags to files.

use super::arrival::{degrees, named_walls, percent};
use super::arrival_figure::{self, ArrivalFigure};
use super::maps::{progress, shown};
use super::placement::{self, TargetChoice, heights, metres};
use anyhow::{Context, ensure};
use clap::ValueEnum;
use glam::DVec3;
use hwall::facets_of;
use hwall_arrival::reachability::{Progress, WallMaps, WallMapsConfig};
use hwall_arrival::{
    ArrivalPlacement, ArrivalPlacementConfig, Atlas, AtlasConfig, BoardExtent, WaitingConfig,
    WeightedTarget, place_base_by_arrival_monitored,
};
use hwall_haptics::Board;
use hwall_kinematics::SrsArm;
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_reachability::{PlacementConfig, Roll, Steps, Target, place_base};
use hwall_scene::Scene;
use hwall_stage::arms::{self, NamedArm};
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::input::floor_pose::FloorPose;
use hwall_stage::input::output::remove_outdated;
use hwall_stage::input::scene_file::SceneFlags;
use hwall_stage::numbers::{counted, whole_within};
use hwall_stage::{note, setting};
use hwall_testkit::{Column, MarkdownTable, table_of};
use std::f64::consts::TAU;
use std::io::Write;
use std::path::{Path, PathBuf};
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
        let report = place_by_arrival(&arm, &scene, &targets, config, waiting, &options.out)?;
        writeln!(out, "{report}")?;
    } else if options.out.join(BY_ARRIVAL[0]).exists() {
        // An arrival.svg without placements_by_arrival.csv belongs to `arrival_map`.
        if let Some(removed) = remove_outdated(&options.out, &BY_ARRIVAL)? {
            writeln!(out, "{removed}")?;
        }
    }
    Ok(())
}

/// Finds the best places for an arm whose tool is the face of the default board, writes placements_by_arrival.csv and, for the best
/// place, arrival.svg; returns the text to print. All points of the room are equally likely to be touched.
///
/// # Errors
/// Settings out of range, nothing within reach, files that cannot be written.
fn place_by_arrival(
    arm: &SrsArm,
    scene: &Scene,
    targets: &[Target],
    places: PlacementConfig,
    waiting: WaitingConfig,
    out: &Path,
) -> anyhow::Result<String> {
    let board = BoardExtent::default();
    let limits = MotionLimits::of_arm(arm, &MotionConfig::default())?;
    let targets: Vec<WeightedTarget> = targets.iter().map(|&t| t.into()).collect();
    let (budget_s, slack_m) = (waiting.budget_s, waiting.slack_m);
    let config = ArrivalPlacementConfig {
        waiting,
        ..ArrivalPlacementConfig::new(places)
    };
    let walls = facets_of(scene);
    let start = Instant::now();
    note("judging places by arrival, which may take a minute");
    let bar = progress();
    let shown = |p: Progress| shown(&bar, p);
    let found =
        place_base_by_arrival_monitored(arm, &targets, &walls, board, &limits, &config, &shown)?;
    bar.finish_and_clear();
    let took = start.elapsed().as_secs_f64();
    arrival_csv(&out.join("placements_by_arrival.csv"), &found.best)?;
    if let Some(best) = found.best.first() {
        let base = FloorPose {
            origin_m: best.room_from_base.position_m(),
            yaw_rad: best.heading_rad,
        };
        let scene = base.scene_seen(scene)?;
        let maps = WallMaps::build(arm, &facets_of(&scene), WallMapsConfig::default())?;
        let q = best.arrivals.posture.q;
        let atlas = Atlas::build(arm, &maps, board, &limits, &q, &AtlasConfig::default())?;
        let waiting = degrees(&q);
        let figure = ArrivalFigure {
            walls: &named_walls(&scene, &atlas),
            budget_s,
            waiting: &format!("base at {base} (x,y,z,yaw), waiting at {waiting} degrees"),
        };
        arrival_figure::draw(&out.join("arrival.svg"), &figure)?;
    }
    Ok(format!(
        "by arrival, within {budget_s} s with {slack_m} m of slack: {} places judged, {took:.1} s\n\n{}\nwrote placements_by_arrival.csv and arrival.svg to {}",
        found.judged,
        arrival_table(&found.best),
        out.display()
    ))
}

/// The best places by arrival as a table.
fn arrival_table(places: &[ArrivalPlacement]) -> MarkdownTable {
    let at = |p: &ArrivalPlacement| p.room_from_base.position_m();
    let posture = |p: &ArrivalPlacement| p.arrivals.posture;
    let seconds = |p: &ArrivalPlacement, share| format!("{:.2} s", p.arrivals.quantile_s(share));
    let columns: [Column<'_, (usize, &ArrivalPlacement)>; 10] = [
        ("", &|(i, _)| i.to_string()),
        ("x, m", &|(_, p)| metres(at(p).x)),
        ("y, m", &|(_, p)| metres(at(p).y)),
        ("heading", &|(_, p)| {
            format!("{:.0} deg", p.heading_rad.to_degrees())
        }),
        ("in time", &|(_, p)| percent(p.in_time_share)),
        ("in reach", &|(_, p)| percent(posture(p).reached_share)),
        ("median", &|(_, p)| seconds(p, 0.5)),
        ("p90", &|(_, p)| seconds(p, 0.9)),
        ("ways clear", &|(_, p)| percent(posture(p).clear_share)),
        ("waiting posture, deg", &|(_, p)| degrees(&posture(p).q)),
    ];
    table_of((1..).zip(places), &columns)
}

/// `x_m,y_m,z_m,heading_rad,in_time,in_reach,median_s,p90_s,q1_rad..q7_rad`, best first.
///
/// # Errors
/// A file that cannot be written.
fn arrival_csv(path: &Path, places: &[ArrivalPlacement]) -> anyhow::Result<()> {
    let mut writer = hwall_stage::numbers::writer(Some(path))?;
    let names = "x_m,y_m,z_m,heading_rad,in_time,in_reach,median_s,p90_s";
    let joints = (1..=7).map(|joint| format!("q{joint}_rad"));
    writer.write_record(names.split(',').map(String::from).chain(joints))?;
    for place in places {
        let base_m = place.room_from_base.position_m();
        let arrivals = &place.arrivals;
        let numbers = [
            place.heading_rad,
            place.in_time_share,
            arrivals.posture.reached_share,
            arrivals.quantile_s(0.5),
            arrivals.quantile_s(0.9),
        ];
        let numbers = numbers.into_iter().chain(arrivals.posture.q.0);
        let base = base_m.to_array().map(|x| format!("{x:.9}"));
        let row = base.into_iter().chain(numbers.map(|x| x.to_string()));
        writer.write_record(row)?;
    }
    writer.flush()
}
