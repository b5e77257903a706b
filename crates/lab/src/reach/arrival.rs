//! Arrival times of an arm at people's touches, and its best waiting posture: from flags to files.

use super::arrival_figure::{self, ArrivalFigure};
use super::placement::heights;
use crate::report::ends as span;
use anyhow::{Context, ensure};
use glam::DVec3;
use hwall::facets_of;
use hwall_arrival::reachability::{WallMaps, WallMapsConfig};
use hwall_arrival::{
    Atlas, AtlasConfig, AtlasWall, BoardExtent, PostureArrivals, Surfaces, TouchRange,
    WaitingConfig, WallShare, judge_posture, targets_of_maps, waiting_posture,
};
use hwall_haptics::Board;
use hwall_kinematics::JointPositions;
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_scene::Scene;
use hwall_stage::arms::{self, NamedArm};
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::input::floor_pose::FloorPose;
use hwall_stage::input::scene_file::{self, SceneFlags};
use hwall_stage::numbers::counted;
use hwall_stage::{note, setting};
use hwall_testkit::{Column, MarkdownTable, Timing, quantiles, table_of, time_batches};
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

/// A configuration from seven numbers in degrees.
///
/// # Errors
/// Anything but seven finite numbers.
pub fn configuration(text: &str) -> anyhow::Result<JointPositions> {
    Ok(JointPositions::from_deg(arms::parse_list::<7>(text)?))
}

/// A configuration as seven numbers in degrees.
pub fn degrees(q: &JointPositions) -> String {
    let joints = q.0.map(|q| format!("{:.1}", q.to_degrees()));
    joints.join(",")
}

/// Arrival times at the targets, one row per posture.
pub fn posture_table(postures: &[(&str, PostureArrivals)]) -> MarkdownTable {
    let within = |a: &PostureArrivals, time_s: f64| percent(a.share_within(time_s));
    let late = |a: &PostureArrivals| format!("{:.0} ms", 1e3 * a.posture.expected_lateness_s);
    let columns: [Column<'_, &(&str, PostureArrivals)>; 10] = [
        ("posture", &|(name, _)| (*name).to_owned()),
        ("joints, deg", &|(_, a)| degrees(&a.posture.q)),
        ("within 0.5 s", &|(_, a)| within(a, 0.5)),
        ("0.6 s", &|(_, a)| within(a, 0.6)),
        ("0.7 s", &|(_, a)| within(a, 0.7)),
        ("median", &|(_, a)| format!("{:.2} s", a.quantile_s(0.5))),
        ("p90", &|(_, a)| format!("{:.2} s", a.quantile_s(0.9))),
        ("late on average", &|(_, a)| late(a)),
        ("ways clear", &|(_, a)| percent(a.posture.clear_share)),
        ("behind surfaces", &|(_, a)| {
            format!("{:.0} mm", 1e3 * a.posture.standoff_m)
        }),
    ];
    table_of(postures, &columns)
}

/// One row per touchable wall of an atlas.
pub fn wall_table(walls: &[(String, &AtlasWall)]) -> MarkdownTable {
    let nodes = |wall: &AtlasWall| -> Vec<_> {
        let nodes = wall.places().filter_map(|place| wall.node(place).copied());
        nodes.collect()
    };
    let at = |wall: &AtlasWall, share: f64| {
        let times_s = nodes(wall).into_iter().map(|node| node.arrival_s);
        format!("{:.2} s", quantiles(times_s, [share])[0])
    };
    let clear = |wall: &AtlasWall| {
        let nodes = nodes(wall);
        let clear = nodes.iter().filter(|node| node.clear).count();
        percent(clear as f64 / nodes.len() as f64)
    };
    let holes = |wall: &AtlasWall| wall.places().count() - nodes(wall).len();
    let columns: [Column<'_, &(String, &AtlasWall)>; 9] = [
        ("wall", &|(name, _)| name.clone()),
        ("nodes", &|(_, wall)| nodes(wall).len().to_string()),
        ("holes", &|(_, wall)| holes(wall).to_string()),
        ("ways clear", &|(_, wall)| clear(wall)),
        ("seams", &|(_, wall)| wall.seams().count().to_string()),
        ("soonest", &|(_, wall)| at(wall, 0.0)),
        ("median", &|(_, wall)| at(wall, 0.5)),
        ("p90", &|(_, wall)| at(wall, 0.9)),
        ("latest", &|(_, wall)| at(wall, 1.0)),
    ];
    table_of(walls, &columns)
}

/// The walls of an atlas that are outer sides of surfaces of the scene, with the surface's name. If a surface has
/// several, the heading of the normal is appended, and the distance from the base if that is the same, too.
pub fn named_walls<'a>(scene: &Scene, atlas: &'a Atlas) -> Vec<(String, &'a AtlasWall)> {
    /// Planes and borders that differ by less are the same, m.
    const SAME_M: f64 = 1e-6;
    let facets = scene.vertical_facets();
    let name_of = |wall: &AtlasWall| {
        let plane = wall.plane();
        let along = wall.along();
        let ends = [along.at(0), along.at(along.count() - 1)];
        let of_plane = facets.iter().filter_map(|facet| {
            let same = facet.normal.dot(plane.normal()) > 1.0 - SAME_M
                && plane.project(facet.point_m).off_m.abs() < SAME_M;
            let outline = facet.outline_m.iter();
            let (lo, hi) = span(outline.map(|p| plane.along().dot(*p)));
            let holds = lo - SAME_M <= ends[0] && ends[1] <= hi + SAME_M;
            (same && holds).then_some((hi - lo, facet))
        });
        let narrowest = of_plane.min_by(|a, b| a.0.total_cmp(&b.0));
        narrowest.map(|(_, facet)| scene.surface(facet.surface).name.clone())
    };
    let named = |wall: &'a AtlasWall| Some((name_of(wall)?, wall));
    let walls: Vec<(String, &AtlasWall)> = atlas.walls().iter().filter_map(named).collect();
    told_apart(walls, |wall| {
        let plane = wall.plane();
        let (normal, distance_m) = (plane.normal(), plane.distance_m());
        // Not -0.
        let heading_deg = normal.y.atan2(normal.x).to_degrees().round() + 0.0;
        [
            format!(", {heading_deg:.0}°"),
            format!(", {distance_m:.2} m"),
        ]
    })
}

/// Makes names unique by appending `more`; remaining duplicates are numbered.
fn told_apart<T>(named: Vec<(String, T)>, more: impl Fn(&T) -> [String; 2]) -> Vec<(String, T)> {
    let mut names: Vec<String> = named.iter().map(|(name, _)| name.clone()).collect();
    let number = |at: usize| format!(" ({})", at + 1);
    for step in 0..3 {
        let before = names.clone();
        let is_repeated = |name: &String| before.iter().filter(|other| *other == name).count() > 1;
        for (at, (name, (_, of))) in names.iter_mut().zip(&named).enumerate() {
            if is_repeated(&*name) {
                *name += more(of).get(step).unwrap_or(&number(at));
            }
        }
    }
    let of = named.into_iter().map(|(_, of)| of);
    names.into_iter().zip(of).collect()
}

/// Times look-ups at points off the nodes by a fraction of the spacing, so that four nodes contribute.
pub fn time_look_ups(atlas: &Atlas, slack_m: Option<f64>) -> Timing {
    /// Calls in a batch, and batches.
    const CALLS: [usize; 2] = [1000, 50];
    let places: Vec<(DVec3, DVec3)> = atlas
        .walls()
        .iter()
        .flat_map(|wall| {
            let normal = wall.plane().normal();
            let beside_m = wall.plane().along() * 0.013 + DVec3::Z * 0.017;
            let nodes = wall.places().filter(|&place| wall.node(place).is_some());
            nodes.map(move |place| (wall.point_m(place) + beside_m, normal))
        })
        .collect();
    time_batches(CALLS[1], CALLS[0], |i| {
        let (point_m, normal) = places[i % places.len()];
        match slack_m {
            Some(slack_m) => atlas.look_up_within(point_m, normal, slack_m),
            None => atlas.look_up(point_m, normal),
        }
    })
}

pub(super) fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_of_one_surface_are_told_apart() {
        let walls = [
            ("side", ["a", "1"]),
            ("side", ["b", "1"]),
            ("front", ["a", "1"]),
            ("back", ["a", "1"]),
            ("back", ["a", "2"]),
            ("lid", ["a", "1"]),
            ("lid", ["a", "1"]),
        ];
        let named = walls.map(|(name, more)| (name.to_owned(), more));
        let named = told_apart(named.into(), |more| more.map(|word| format!(" {word}")));
        let names: Vec<&str> = named.iter().map(|(name, _)| name.as_str()).collect();
        let apart = "side a, side b, front, back a 1, back a 2, lid a 1 (6), lid a 1 (7)";
        assert_eq!(names.join(", "), apart);
    }
}
