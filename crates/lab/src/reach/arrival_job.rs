//! Arrival times of an arm at people's touches, and its best waiting posture: from flags to files.

use super::arrival::{
    configuration, degrees, named_walls, posture_table, time_look_ups, wall_table,
};
use super::arrival_figure::{self, ArrivalFigure};
use super::placement_job::heights;
use anyhow::{Context, ensure};
use glam::DVec3;
use hwall::facets_of;
use hwall_arrival::reachability::{WallMaps, WallMapsConfig};
use hwall_arrival::{
    Atlas, AtlasConfig, BoardExtent, Surfaces, TouchRange, WaitingConfig, WallShare, judge_posture,
    targets_of_maps, waiting_posture,
};
use hwall_haptics::Board;
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_stage::arms::{self, NamedArm};
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::input::floor_pose::FloorPose;
use hwall_stage::input::scene_file::{self, SceneFlags};
use hwall_stage::numbers::counted;
use hwall_stage::{note, setting};
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

/// Arm, scene and touches, as flags of a command line.
#[derive(Debug, Clone, clap::Args)]
pub struct ArrivalOptions {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneFlags,
    /// The arm's base in the scene: x,y,z,yaw in metres and degrees
    #[arg(long, allow_hyphen_values = true)]
    pub base: Option<String>,
    /// People touch between these heights above the base, low,high in metres
    #[arg(long, default_value = "0.15,1.3", allow_hyphen_values = true)]
    pub heights: String,
    /// People touch within a ball: x,y,z,radius in metres [default: anywhere]
    #[arg(long, allow_hyphen_values = true)]
    pub near: Option<String>,
    /// Touches in proportion to the walls' areas, instead of the same number on each wall
    #[arg(long)]
    pub by_area: bool,
    /// Largest distance of the middle of the board from the touched place, m
    #[arg(long, default_value_t = 0.055, allow_negative_numbers = true)]
    pub slack_m: f64,
    /// Time from when a target is known to the touch, s
    #[arg(long, default_value_t = 0.7, allow_negative_numbers = true)]
    pub budget_s: f64,
    /// Use this waiting posture instead: seven joints in degrees
    #[arg(long, allow_hyphen_values = true)]
    pub waiting: Option<String>,
    /// Also evaluate this posture: seven joints in degrees
    #[arg(long, allow_hyphen_values = true)]
    pub beside: Option<String>,
    /// The arm.
    #[command(flatten)]
    pub arm: NamedArm,
    /// Save the atlas as a file that the library loads
    #[arg(long)]
    pub save: Option<PathBuf>,
    /// Output folder
    #[arg(long, default_value = "out/arrival")]
    pub out: PathBuf,
}

/// The range of touches, from the flags.
fn touches(options: &ArrivalOptions) -> anyhow::Result<TouchRange> {
    let near = options.near.as_deref().map(arms::parse_list::<4>);
    let near = near.transpose().context("--near")?;
    Ok(TouchRange {
        heights: heights(&options.heights)?,
        spacing_m: 0.1,
        share: match options.by_area {
            true => WallShare::Area,
            false => WallShare::Equal,
        },
        ball: near.map(|[x, y, z, radius_m]| (DVec3::new(x, y, z), radius_m)),
        ..TouchRange::default()
    })
}

/// Finds the posture, builds the atlas, writes the files and prints the tables.
///
/// # Errors
/// Invalid flags, a scene without walls within reach, files that cannot be read or written.
pub fn run(options: &ArrivalOptions, out: &mut impl Write) -> anyhow::Result<()> {
    FilePlan::default()
        .read_scene("--scene", options.scene.scene.as_deref())
        .write_into("--out", Some(&options.out), &["arrival.svg"])
        .write("--save", options.save.as_deref())
        .check()?;
    let face = Board::default().flange_from_board_face()?;
    let arm = options.arm.closed_form()?.with_tool(face);
    let base = options.base.as_deref().map(FloorPose::parse).transpose()?;
    let (scene, remarks) = setting::load_scene(options.scene.file())?;
    let scene = base.unwrap_or(FloorPose::ORIGIN).scene_seen(&scene)?;
    for remark in remarks {
        note(remark);
    }
    let config = WaitingConfig {
        budget_s: options.budget_s,
        slack_m: options.slack_m,
        ..WaitingConfig::default()
    };
    let maps = WallMaps::build(&arm, &facets_of(&scene), WallMapsConfig::default())?;
    ensure!(
        maps.map().is_some(),
        "no wall of the scene is within the length of the arm ({})",
        scene_file::looks_like(&scene)
    );
    let limits = MotionLimits::of_arm(&arm, &MotionConfig::default())?;
    let targets = targets_of_maps(&maps, &touches(options)?)?;
    let surfaces = Surfaces::from_maps(&maps, config.clearance.margin_m)?;
    let extent = BoardExtent::default();
    let start = Instant::now();
    let waiting = match &options.waiting {
        Some(text) => configuration(text).context("--waiting")?,
        None => waiting_posture(&arm, &targets, &surfaces, extent, &limits, &config)?.q,
    };
    let waiting_took = start.elapsed().as_secs_f64();
    let judged = |q| judge_posture(q, &arm, &targets, &surfaces, extent, &limits, &config);
    let mut postures = vec![("waiting", judged(&waiting)?)];
    if let Some(text) = &options.beside {
        let q = configuration(text).context("--beside")?;
        postures.push(("beside", judged(&q)?));
    }
    let start = Instant::now();
    let atlas_config = AtlasConfig::default();
    let atlas = Atlas::build(&arm, &maps, extent, &limits, &waiting, &atlas_config)?;
    let atlas_took = start.elapsed().as_secs_f64();
    let [plain, slack] =
        [None, Some(options.slack_m)].map(|slack_m| time_look_ups(&atlas, slack_m).median_ns);
    let walls = named_walls(&scene, &atlas);
    std::fs::create_dir_all(&options.out).with_context(|| options.out.display().to_string())?;
    let figure = ArrivalFigure {
        walls: &walls,
        budget_s: options.budget_s,
        waiting: &format!("waiting at {} degrees", degrees(&waiting)),
    };
    arrival_figure::draw(&options.out.join("arrival.svg"), &figure)?;
    if let Some(path) = &options.save {
        atlas.save(path)?;
    }
    writeln!(
        out,
        "{}, slack {} m, budget {} s; waiting posture: {waiting_took:.2} s\n\n{}\natlas: {} nodes, {} bytes, {atlas_took:.3} s; look-up {plain:.0} ns, with slack {slack:.0} ns\n\n{}\nwrote arrival.svg to {}",
        counted(targets.len(), "target", "targets"),
        options.slack_m,
        options.budget_s,
        posture_table(&postures),
        atlas.nodes().count(),
        atlas.to_bytes()?.len(),
        wall_table(&walls),
        options.out.display()
    )?;
    Ok(())
}
