//! Reachability maps: speed against error.

use crate::reach::orientation_rows::{Disagreement, disagreement};
use crate::reach::published;
use crate::speed::section::{Calls, Section, batches};
use anyhow::Context;
use glam::DVec3;
use hwall_kinematics::{Pose, SrsArm};
use hwall_reachability::{
    ExactConfig, ExactSolver, Interval, PolygonConfig, ReachabilityMap, WallGrid, WallPlane,
    WallRegion, position_margin_m,
};
use hwall_testkit::{Sampler, format_error, time_each, titled};

/// Repetitions of building a map; the median counts.
const BUILDS: usize = 7;

/// Number of points for look-ups: more would also measure memory access.
const SOME: usize = 64;

fn config(accuracy_m: f64) -> ExactConfig {
    ExactConfig {
        accuracy_m,
        ..ExactConfig::default()
    }
}

/// Median time of several builds on `threads` threads, s.
fn build_s(threads: usize, config: &ExactConfig, walls: &[WallGrid]) -> anyhow::Result<f64> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    let (pool, arm) = (pool.build().context("threads")?, SrsArm::iiwa7());
    let timing = time_each(BUILDS, |_| {
        pool.install(|| ReachabilityMap::build(&arm, config, walls.to_vec()).is_ok())
    });
    Ok(1e-9 * timing.median_ns)
}

/// Whole maps: build time, memory, share without proof.
///
/// # Errors
/// Errors of the solvers.
pub fn maps(seed: u64, poses: usize) -> anyhow::Result<Section> {
    let published = published::grids()?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut table = titled(&format!(
        "grid | accuracy | lines | solved | one core | {cores} cores | memory | file | without proof"
    ));
    let mut summary = Vec::new();
    let arm = SrsArm::iiwa7();
    for accuracy_m in [1e-2, 1e-4, 1e-6, 1e-8] {
        let config = config(accuracy_m);
        let map = ReachabilityMap::build(&arm, &config, published.clone())?;
        let one = build_s(1, &config, &published)?;
        let all = build_s(cores, &config, &published)?;
        let (lengths, report) = (map.lengths(), map.report());
        let unknown = 100.0 * lengths.unknown_m / lengths.reachable_m;
        table.row([
            "published".to_owned(),
            format_error(accuracy_m, "m"),
            report.lines.to_string(),
            report.solved.to_string(),
            format!("{one:.3} s"),
            format!("{all:.3} s"),
            format!("{} kB", map.memory_bytes() / 1000),
            format!("{} kB", map.to_bytes().len() / 1000),
            format!("{unknown:.5} %"),
        ]);
        if accuracy_m == 1e-6 {
            summary.push([
                "reachability".to_owned(),
                format!("map of {} lines, one core", report.lines),
                format!("{:.0} ms", 1e3 * one),
                String::new(),
                "ends within 1e-6 m, proven".to_owned(),
            ]);
        }
    }
    let map = ReachabilityMap::build(&arm, &ExactConfig::default(), published)?;
    let Disagreement { wrong, unproven } = disagreement(&map, seed, poses)?;
    Section::of(include_str!("text/maps.md"), summary).filled(&[
        ("poses", &poses),
        ("wrong", &wrong),
        ("unproven", &unproven),
        ("table", &table),
    ])
}

/// Look-ups, margins, nearest points, one wall of a scene, polygons.
///
/// # Errors
/// Errors of the solvers.
pub fn queries(seed: u64, n: usize) -> anyhow::Result<Section> {
    let arm = SrsArm::iiwa7();
    let map = ReachabilityMap::build(&arm, &config(1e-6), WallGrid::dissertation())?;
    let mut sampler = Sampler::new(seed);
    let place = |_| {
        let heading: f64 = sampler.uniform(-0.9, 0.9);
        let normal = DVec3::new(heading.cos(), heading.sin(), 0.0);
        let (low, high) = (DVec3::new(-0.9, -0.9, -0.25), DVec3::new(0.9, 0.9, 1.2));
        (sampler.point_in_box(low, high), normal)
    };
    let places: Vec<(DVec3, DVec3)> = (0..n).map(place).collect();
    let mut calls = Calls::new("what | median | p99 | error");
    let look_up = batches(|i| map.look_up(places[i % SOME].0, places[i % SOME].1));
    let (mut asked, mut wrong) = (0_usize, 0_usize);
    for (point, normal) in &places {
        if let Some(found) = map.look_up(*point, *normal) {
            asked += 1;
            wrong += usize::from(map.is_reachable(*point, *normal)? != found.reachable);
        }
    }
    let wrong = 100.0 * wrong as f64 / asked.max(1) as f64;
    let what = "look-up: nearest orientation, plane, height";
    let error = format!("{wrong:.1} % other than the exact verdict at the point");
    calls.row(what, &look_up, [&error]);
    calls.quote("reachability", "look-up in a map", &look_up, "nearest line");
    let exact = batches(|i| map.is_reachable(places[i % SOME].0, places[i % SOME].1));
    calls.row("exact look-up at the point", &exact, ["none (1e-13)"]);

    let mut reachable: Vec<Pose> = Vec::new();
    for (point, normal) in &places {
        let plane = WallPlane::through(*point, *normal)?;
        let pose = plane.board_pose(plane.project(*point).at, 0.0)?;
        if reachable.len() < 2_000 && arm.is_reachable(&pose) {
            reachable.push(pose);
        }
    }
    let margin = time_each(reachable.len(), |i| {
        position_margin_m(&arm, &reachable[i], 0.0)
    });
    let error = "a proven lower bound";
    calls.row("certified margin of a pose", &margin, [error]);
    calls.quote("reachability", "certified margin", &margin, error);
    let solver = ExactSolver::new(&arm, &config(1e-6))?;
    let heights = Interval::new(-0.25, 1.25);
    let wall = |_| {
        let (point, normal) = places[sampler.index(n)];
        Ok(WallGrid::for_wall(point, normal, heights, 0.05)?)
    };
    let walls: Vec<WallGrid> = (0..200).map(wall).collect::<anyhow::Result<_>>()?;
    let one_wall = time_each(walls.len(), |i| {
        ReachabilityMap::build(&arm, &config(1e-6), vec![walls[i].clone()]).is_ok()
    });
    let (what, error) = ("map of one wall, 31 heights", "1e-6 m, proven");
    calls.row(what, &one_wall, [error]);
    calls.quote("reachability", what, &one_wall, error);
    let planes: Vec<WallPlane> = published::grids()?
        .iter()
        .flat_map(|wall| (0..wall.distances.count()).map(|i| wall.plane(i)))
        .collect::<Result<_, _>>()?;
    let polygon = PolygonConfig {
        accuracy_m: 1e-4,
        ..PolygonConfig::default()
    };
    let of_plane = time_each(planes.len(), |i| {
        WallRegion::of_plane(&solver, &planes[i], &polygon).is_ok()
    });
    let (what, error) = ("polygons of a plane", "0.1 mm Hausdorff");
    calls.row(what, &of_plane, [error]);
    calls.quote("reachability", what, &of_plane, error);
    Section::of(include_str!("text/queries.md"), calls.summary).filled(&[("table", &calls.table)])
}
