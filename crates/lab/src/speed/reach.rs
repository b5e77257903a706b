//! Reachability maps: speed against error.

use crate::reach::disagreement::{Disagreement, disagreement};
use crate::reach::published;
use crate::report::{Gap, quantiles, titled};
use crate::speed::section::{Calls, Section, batches};
use anyhow::Context;
use glam::DVec3;
use hwall_kinematics::{Chain, Pose, SrsArm};
use hwall_reachability::{
    ExactConfig, ExactSolver, Interval, OptimizationConfig, OptimizationSolver, PolygonConfig,
    ReachabilityMap, Steps, WallGrid, WallLine, WallPlane, WallPoint, WallRegion,
    position_margin_m,
};
use hwall_testkit::{ErrorStats, Sampler, SpeedErrorTable, format_error, time_each};
use std::time::Instant;

/// Repetitions of building a map; the median counts.
const BUILDS: usize = 7;

/// The methods are compared on every n-th line of the published grid.
const EVERY: usize = 23;

/// Number of points for look-ups: more would also measure memory access.
const SOME: usize = 64;

/// Larger errors of the ends of a line are counted, m.
const OFF_M: f64 = 1e-3;

fn config(accuracy_m: f64) -> ExactConfig {
    ExactConfig {
        accuracy_m,
        ..ExactConfig::default()
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn pool(threads: usize) -> anyhow::Result<rayon::ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build().context("threads")
}

/// Median time of several builds on `threads` threads, s.
fn build_s(threads: usize, config: &ExactConfig, walls: &[WallGrid]) -> anyhow::Result<f64> {
    let (pool, arm) = (pool(threads)?, SrsArm::iiwa7());
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
    let cores = cores();
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

/// A method's result on a line.
#[derive(Debug, Clone, Copy)]
struct LineEnds {
    /// The outermost ends, m along the line.
    ends_m: [f64; 2],
    intervals: usize,
}

/// `None` for a line without a reachable point.
type Ends = Option<LineEnds>;

/// The same lines by every method.
///
/// # Errors
/// Errors of the solvers.
pub fn methods(seed: u64) -> anyhow::Result<Section> {
    let (arm, chain) = (SrsArm::iiwa7(), Chain::iiwa7());
    let mut lines: Vec<WallLine> = Vec::new();
    for wall in published::grids()? {
        for plane in 0..wall.distances.count() {
            let plane = wall.plane(plane)?;
            lines.extend(wall.heights.iter().map(|height| plane.line(height)));
        }
    }
    let lines: Vec<WallLine> = lines.into_iter().step_by(EVERY).collect();
    let reference = ExactSolver::new(&arm, &config(1e-9))?;
    let ends_of = |solver: &ExactSolver, line: &WallLine| -> anyhow::Result<Ends> {
        let reach = solver.line(line)?;
        let (first, last) = (reach.intervals.first(), reach.intervals.last());
        Ok(first.zip(last).map(|(a, b)| LineEnds {
            ends_m: [a.span.lo_m, b.span.hi_m],
            intervals: reach.intervals.len(),
        }))
    };
    let mut truth: Vec<(Ends, bool)> = Vec::new();
    for line in &lines {
        let touches = !reference.line(line)?.unknown.is_empty();
        truth.push((ends_of(&reference, line)?, touches));
    }

    let mut table = SpeedErrorTable::new("ends of the lines", "setting");
    let mut row = |name: &str, setting: String, solve: &dyn Fn(usize) -> anyhow::Result<Ends>| {
        let mut found: Vec<anyhow::Result<Ends>> = Vec::with_capacity(lines.len());
        let timing = time_each(lines.len(), |i| found.push(solve(i)));
        let (mut off, mut lost, mut invented, mut holes) = (Vec::new(), 0, 0, 0);
        for ((truth, touches), found) in truth.iter().zip(found) {
            match (truth, found?) {
                (Some(truth), Some(found)) => {
                    let ends = truth.ends_m.iter().zip(found.ends_m);
                    off.extend(ends.map(|(a, b)| (a - b).abs()));
                    holes += usize::from(truth.intervals > found.intervals);
                }
                (Some(truth), None) => {
                    lost += 1;
                    holes += usize::from(truth.intervals > 1);
                }
                // A line that touches the reachable set only in points has undecided bands and no intervals.
                (None, Some(_)) => invented += usize::from(!touches),
                (None, None) => {}
            }
        }
        let far = off.iter().filter(|off| **off > OFF_M).count();
        let note = format!(
            "{:.1} % off by > 1 mm, {lost} lines lost, {invented} invented, {holes} with holes lost",
            100.0 * far as f64 / off.len().max(1) as f64
        );
        let errors = ErrorStats::from_errors(off);
        table.row(name, setting, timing, (errors, "m"), note);
        anyhow::Ok(())
    };
    for accuracy_m in [1e-2, 1e-3, 1e-4, 1e-6, 1e-8] {
        let solver = ExactSolver::new(&arm, &config(accuracy_m))?;
        let setting = format_error(accuracy_m, "m");
        row("exact, a line alone", setting, &|i| {
            ends_of(&solver, &lines[i])
        })?;
    }
    for starts in [1, 2, 5, 10, 20] {
        let config = OptimizationConfig {
            starts,
            seed,
            ..OptimizationConfig::default()
        };
        let solver = OptimizationSolver::new(&chain, config)?;
        row("optimization", format!("{starts} starts"), &|i| {
            Ok(solver.line(&lines[i])?.map(|f| LineEnds {
                ends_m: [f.lo.s_m, f.hi.s_m],
                intervals: 1,
            }))
        })?;
    }
    let (count, shown) = (lines.len(), table.to_markdown());
    let gaps: [Gap<'_>; 2] = [("count", &count), ("table", &shown)];
    Section::of(include_str!("text/methods.md"), &gaps, Vec::new())
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
    let polygons = polygons(&solver)?;
    let gaps: [Gap<'_>; 2] = [("table", &calls.table), ("polygons", &polygons.table)];
    let summary = [calls.summary, polygons.summary].concat();
    Section::of(include_str!("text/queries.md"), &gaps, summary)
}

/// Polygons of all planes of the published grid.
fn polygons(solver: &ExactSolver) -> anyhow::Result<Calls> {
    let cores = cores();
    let mut calls = Calls::new(&format!(
        "Hausdorff accuracy | a plane, median | p99 | 266 planes, one core | {cores} cores | corners a plane | largest area error"
    ));
    let planes: Vec<WallPlane> = published::grids()?
        .iter()
        .flat_map(|wall| (0..wall.distances.count()).map(|i| wall.plane(i)))
        .collect::<Result<_, _>>()?;
    let config = |accuracy_m| PolygonConfig {
        accuracy_m,
        ..PolygonConfig::default()
    };
    // The area error is measured on some of the planes; the finest polygon is the reference.
    let areas = |config: &PolygonConfig| -> anyhow::Result<Vec<f64>> {
        let some = planes.iter().step_by(12);
        some.map(|plane| Ok(WallRegion::of_plane(solver, plane, config)?.area_m2()))
            .collect()
    };
    let fine = areas(&config(1e-6))?;
    for accuracy_m in [1e-2, 1e-3, 1e-4, 1e-5] {
        let config = config(accuracy_m);
        let timing = time_each(planes.len(), |i| {
            WallRegion::of_plane(solver, &planes[i], &config).is_ok()
        });
        let total_s = |threads: usize| {
            let pool = pool(threads)?;
            let start = Instant::now();
            let regions = pool.install(|| WallRegion::of_planes(solver, &planes, &config))?;
            let corners: usize = regions.iter().map(|r| r.vertices().len()).sum();
            anyhow::Ok((start.elapsed().as_secs_f64(), corners))
        };
        let ((one_s, corners), (all_s, _)) = (total_s(1)?, total_s(cores)?);
        let off = areas(&config)?;
        let off = off
            .iter()
            .zip(&fine)
            .map(|(area, fine)| (area - fine).abs());
        calls.row(
            &format_error(accuracy_m, "m"),
            &timing,
            [
                &format!("{one_s:.2} s"),
                &format!("{all_s:.2} s"),
                &format!("{:.0}", corners as f64 / planes.len() as f64),
                &format_error(off.fold(0.0, f64::max), "m²"),
            ],
        );
        if accuracy_m == 1e-4 {
            let error = "0.1 mm Hausdorff";
            calls.quote("reachability", "polygons of a plane", &timing, error);
        }
    }
    Ok(calls)
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
