//! Reachability maps: speed against error.

use crate::reach::disagreement::{Disagreement, disagreement};
use crate::reach::published;
use crate::report::{Gap, quantiles, titled};
use crate::speed::section::{Calls, Section, batches};
use anyhow::Context;
use glam::DVec3;
use hwall_kinematics::{Pose, SrsArm};
use hwall_reachability::{
    ExactConfig, ExactSolver, Interval, PolygonConfig, ReachabilityMap, Steps, WallGrid, WallPlane,
    WallPoint, WallRegion, position_margin_m,
};
use hwall_testkit::{Sampler, format_error, time_each};

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
    let mut dense = published.clone();
    for wall in &mut dense {
        wall.heights = Steps::new(-0.26, 0.005, 301)?;
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut table = titled(&format!(
        "grid | accuracy | lines | solved | one core | {cores} cores | memory | file | without proof"
    ));
    let mut summary = Vec::new();
    let arm = SrsArm::iiwa7();
    for (name, grid, accuracies) in [
        ("published", &published, &[1e-2, 1e-4, 1e-6, 1e-8][..]),
        ("published, heights 5 mm apart", &dense, &[1e-6]),
        ("dissertation", &WallGrid::dissertation(), &[1e-6]),
    ] {
        for &accuracy_m in accuracies {
            let config = config(accuracy_m);
            let map = ReachabilityMap::build(&arm, &config, grid.clone())?;
            let (one, all) = (build_s(1, &config, grid)?, build_s(cores, &config, grid)?);
            let (lengths, report) = (map.lengths(), map.report());
            let unknown = 100.0 * lengths.unknown_m / lengths.reachable_m;
            table.row([
                name.to_owned(),
                format_error(accuracy_m, "m"),
                report.lines.to_string(),
                report.solved.to_string(),
                format!("{one:.3} s"),
                format!("{all:.3} s"),
                format!("{} kB", map.memory_bytes() / 1000),
                format!("{} kB", map.to_bytes().len() / 1000),
                format!("{unknown:.5} %"),
            ]);
            if accuracy_m == 1e-6 && name == "published" {
                summary.push([
                    "reachability".to_owned(),
                    format!("map of {} lines, one core", report.lines),
                    format!("{:.0} ms", 1e3 * one),
                    String::new(),
                    "ends within 1e-6 m, proven".to_owned(),
                ]);
            }
        }
    }
    let Disagreement { wrong, unproven } = disagreement(seed, poses)?;
    let gaps: [Gap<'_>; 4] = [
        ("poses", &poses),
        ("wrong", &wrong),
        ("unproven", &unproven),
        ("table", &table),
    ];
    Section::of(include_str!("text/maps.md"), &gaps, summary)
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
    let mut shares: Vec<f64> = Vec::new();
    for pose in reachable.iter().step_by(20) {
        if let Some(proven) = position_margin_m(&arm, pose, 0.0)? {
            shares.push(proven / true_margin_m(&arm, pose, proven, &mut sampler));
        }
    }
    let [least, median] = quantiles(shares, [0.0, 0.5]).map(|share| 100.0 * share);
    let error = format!(
        "{median:.0} % (median), {least:.0} % (least) of the margin that 300 directions show"
    );
    calls.row("certified margin of a pose", &margin, [&error]);
    let error = "a proven lower bound";
    calls.quote("reachability", "certified margin", &margin, error);
    let solver = ExactSolver::new(&arm, &config(1e-6))?;
    let beyond = |_| {
        let plane = WallPlane::new(sampler.uniform(-0.8, 0.8), sampler.uniform(0.2, 0.8))?;
        let at = WallPoint::new(sampler.uniform(0.9, 1.3), sampler.uniform(-0.2, 1.2));
        Ok((plane, at))
    };
    let beyond: Vec<(WallPlane, WallPoint)> =
        (0..300).map(beyond).collect::<anyhow::Result<_>>()?;
    let nearest = time_each(beyond.len(), |i| {
        solver.nearest_reachable(&beyond[i].0, beyond[i].1).is_ok()
    });
    let error = "1e-5 m to the nearest that a sweep of 1.5 % of the arm sees";
    calls.row("nearest reachable point of a wall", &nearest, [error]);
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
    let gaps: [Gap<'_>; 1] = [("table", &calls.table)];
    Section::of(include_str!("text/queries.md"), &gaps, calls.summary)
}

/// Distance to the nearest unreachable point along 300 random directions, m.
fn true_margin_m(arm: &SrsArm, pose: &Pose, proven: f64, sampler: &mut Sampler) -> f64 {
    let mut least = 4.0 * proven;
    for _ in 0..300 {
        let direction = sampler.unit_vector();
        let reachable = |r: f64| arm.is_reachable(&pose.at(pose.position_m() + direction * r));
        let out = (1..=40)
            .map(|k| least * f64::from(k) / 40.0)
            .find(|r| !reachable(*r));
        if let Some(out) = out {
            let (mut lo, mut hi) = (out - least / 40.0, out);
            while hi - lo > 1e-3 * least {
                let middle = 0.5 * (lo + hi);
                *(if reachable(middle) { &mut lo } else { &mut hi }) = middle;
            }
            least = hi;
        }
    }
    least
}
