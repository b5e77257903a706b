//! Reachability maps: speed against error.

use crate::reach::disagreement::{Disagreement, disagreement};
use crate::reach::published;
use crate::report::quantiles;
use crate::speed::page::section::{Figure, Section, SummaryRow, batches};
use anyhow::Context;
use glam::DVec3;
use hwall_kinematics::{Chain, Pose, SrsArm};
use hwall_reachability::{
    ExactConfig, ExactSolver, Interval, OptimizationConfig, OptimizationSolver, PolygonConfig,
    ReachabilityMap, Steps, WallGrid, WallLine, WallPlane, WallPoint, WallRegion,
    position_margin_m,
};
use hwall_testkit::{
    ErrorStats, MarkdownTable, Sampler, SpeedErrorTable, Timing, format_error, format_ns, time_each,
};
use std::fmt::Write as _;
use std::time::Instant;

/// Builds of a map are repeated this often; the median counts.
const BUILDS: usize = 7;

/// The methods are compared on one line in this many of the published grid.
const EVERY: usize = 23;

/// Look-ups go round this many places: with more of them, the memory they take would be measured too.
const SOME: usize = 64;

/// Ends of a line that are further off than this are counted, m.
const OFF_M: f64 = 1e-3;

fn config(accuracy_m: f64) -> ExactConfig {
    ExactConfig {
        accuracy_m,
        ..ExactConfig::default()
    }
}

/// Median time of several builds on a pool of `threads` threads, s.
fn build_s(threads: usize, config: &ExactConfig, walls: &[WallGrid]) -> anyhow::Result<f64> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .context("threads")?;
    let arm = SrsArm::iiwa7();
    let timing = time_each(BUILDS, |_| {
        pool.install(|| ReachabilityMap::build(&arm, config, walls.to_vec()).is_ok())
    });
    Ok(1e-9 * timing.median_ns)
}

/// Whole maps: build time, memory, share without proof.
///
/// # Errors
/// Whatever the solvers refuse.
pub fn maps(seed: u64, poses: usize) -> anyhow::Result<Section> {
    let published = published::grids()?;
    let dense: Vec<WallGrid> = published
        .iter()
        .map(|wall| {
            let heights = Steps::new(-0.26, 0.005, 301)?;
            Ok(WallGrid {
                heights,
                ..wall.clone()
            })
        })
        .collect::<anyhow::Result<_>>()?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut table = MarkdownTable::new([
        "grid",
        "accuracy",
        "lines",
        "solved",
        "one core",
        &format!("{cores} cores"),
        "memory",
        "file",
        "without proof",
    ]);
    let mut quoted = Vec::new();
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
            let lengths = map.lengths();
            let (reachable, unknown) = (lengths.reachable_m, lengths.unknown_m);
            let report = map.report();
            table.row([
                name.to_owned(),
                format_error(accuracy_m, "m"),
                report.lines.to_string(),
                report.solved.to_string(),
                format!("{:.3} s", one),
                format!("{:.3} s", all),
                format!("{} kB", map.memory_bytes() / 1000),
                format!("{} kB", map.to_bytes().len() / 1000),
                format!("{:.5} %", 100.0 * unknown / reachable),
            ]);
            if accuracy_m == 1e-6 && name == "published" {
                quoted.push(SummaryRow::of_job(
                    "reachability",
                    format!("map of {} lines, one core", report.lines),
                    one,
                    "ends within 1e-6 m, proven",
                ));
            }
        }
    }
    let Disagreement { wrong, unproven } = disagreement(seed, poses)?;
    let text = format!(
        "### Reachability maps: build time, memory, proof\n\nWithout proof: share of the reachable length \
         that lies in bands about the ends. One line stands for its mirror image and for all headings \
         where the symmetry is proven, which is why fewer are solved than the map holds. Against the \
         predicate, on {poses} poses of the published grid (half of them within 0.1 m to 1e-10 m of an \
         end): **{wrong} wrong**, {unproven} in bands.\n\n{table}"
    );
    Ok(Section::of(text, quoted))
}

/// What a method finds on a line.
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
/// Whatever the solvers refuse.
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
    let truth: Vec<Ends> = lines
        .iter()
        .map(|line| ends_of(&reference, line))
        .collect::<anyhow::Result<_>>()?;
    let touching: Vec<bool> = lines
        .iter()
        .map(|line| Ok(!reference.line(line)?.unknown.is_empty()))
        .collect::<anyhow::Result<_>>()?;

    let mut rows = SpeedErrorTable::new("ends of the lines", "setting");
    let mut row = |name: &str,
                   setting: String,
                   solve: &mut dyn FnMut(usize) -> anyhow::Result<Ends>| {
        let mut found: Vec<anyhow::Result<Ends>> = Vec::with_capacity(lines.len());
        let timing = time_each(lines.len(), |i| found.push(solve(i)));
        let found: Vec<Ends> = found.into_iter().collect::<anyhow::Result<_>>()?;
        let (mut off, mut lost, mut invented, mut holes) = (Vec::new(), 0, 0, 0);
        for (i, (truth, found)) in truth.iter().zip(&found).enumerate() {
            match (truth, found) {
                (Some(truth), Some(found)) => {
                    let ends = truth.ends_m.iter().zip(found.ends_m);
                    off.extend(ends.map(|(a, b)| (a - b).abs()));
                    holes += usize::from(truth.intervals > found.intervals);
                }
                (Some(truth), None) => {
                    lost += 1;
                    holes += usize::from(truth.intervals > 1);
                }
                // A line that touches the reachable set in points has bands and no intervals.
                (None, Some(_)) if touching[i] => {}
                (None, Some(_)) => invented += 1,
                (None, None) => {}
            }
        }
        let n = off.len().max(1) as f64;
        let far = off.iter().filter(|off| **off > OFF_M).count();
        let note = format!(
            "{:.1} % off by > 1 mm, {lost} lines lost, {invented} invented, {holes} with holes lost",
            100.0 * far as f64 / n
        );
        let errors = ErrorStats::from_errors(off);
        rows.row(name, setting, timing, (errors, "m"), note);
        Ok::<Timing, anyhow::Error>(timing)
    };
    for accuracy_m in [1e-2, 1e-3, 1e-4, 1e-6, 1e-8] {
        let solver = ExactSolver::new(&arm, &config(accuracy_m))?;
        let setting = format_error(accuracy_m, "m");
        row("exact, a line alone", setting, &mut |i| {
            ends_of(&solver, &lines[i])
        })?;
    }
    for starts in [1, 2, 5, 10, 20] {
        let solver = OptimizationSolver::new(
            &chain,
            OptimizationConfig {
                starts,
                seed,
                ..OptimizationConfig::default()
            },
        )?;
        row("optimization", format!("{starts} starts"), &mut |i| {
            let found = solver.line(&lines[i])?;
            Ok(found.map(|f| LineEnds {
                ends_m: [f.lo.s_m, f.hi.s_m],
                intervals: 1,
            }))
        })?;
    }
    let count = lines.len();
    let text = format!(
        "### Ends of {count} lines of the published grid, by method\n\nErrors: distance of the outermost \
         ends from the exact solver's at 1e-9 m, on lines that both call reachable. Extremes on lines that only touch \
         the reachable set in points are not counted as invented. A hole is \
         lost where a method knows fewer intervals. Median and p99 are per line. Asking the middles of voxels \
         instead is off by half a voxel at each end, whoever answers: 24 mm at most with 5 cm; that took 5 us a line with the exact verdict and 11 ms with a numeric inverse.\n\n{}",
        rows.to_markdown()
    );
    let figure = Figure::speed_error(
        "lines.svg",
        "Ends of a line: time against the largest error",
        "m",
        rows.rows().to_vec(),
    );
    Ok(Section::of(text, Vec::new()).drawn(figure))
}

/// Look-ups, margins, nearest points, one wall of a scene, polygons.
///
/// # Errors
/// Whatever the solvers refuse.
pub fn queries(seed: u64, n: usize) -> anyhow::Result<Section> {
    let arm = SrsArm::iiwa7();
    let map = ReachabilityMap::build(&arm, &config(1e-6), WallGrid::dissertation())?;
    let mut sampler = Sampler::new(seed);
    let facing = |heading: f64| DVec3::new(heading.cos(), heading.sin(), 0.0);
    let places: Vec<(DVec3, DVec3)> = (0..n)
        .map(|_| {
            let normal = facing(sampler.uniform(-0.9, 0.9));
            let low = DVec3::new(-0.9, -0.9, -0.25);
            (sampler.point_in_box(low, DVec3::new(0.9, 0.9, 1.2)), normal)
        })
        .collect();
    let mut table = MarkdownTable::new(["what", "median", "p99", "error"]);
    let mut row = |what: &str, timing: &Timing, error: String| {
        table.row([
            what.to_owned(),
            format_ns(timing.median_ns),
            format_ns(timing.p99_ns),
            error,
        ]);
    };
    let look_up = batches(|i| map.look_up(places[i % SOME].0, places[i % SOME].1));
    let (mut asked, mut wrong) = (0_usize, 0_usize);
    for (point, normal) in &places {
        if let Some(found) = map.look_up(*point, *normal) {
            asked += 1;
            wrong += usize::from(map.is_reachable(*point, *normal)? != found.reachable);
        }
    }
    let wrong = 100.0 * wrong as f64 / asked.max(1) as f64;
    row(
        "look-up: nearest orientation, plane, height",
        &look_up,
        format!("{wrong:.1} % other than the exact verdict at the point"),
    );
    let exact = batches(|i| map.is_reachable(places[i % SOME].0, places[i % SOME].1));
    row(
        "exact look-up at the point",
        &exact,
        "none (1e-13)".to_owned(),
    );

    let reachable: Vec<Pose> = places
        .iter()
        .map(|(point, normal)| {
            let plane = WallPlane::through(*point, *normal)?;
            Ok(plane.board_pose(plane.project(*point).at, 0.0)?)
        })
        .filter(|pose| pose.as_ref().map_or(true, |pose| arm.is_reachable(pose)))
        .take(2_000)
        .collect::<anyhow::Result<_>>()?;
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
    row(
        "certified margin of a pose",
        &margin,
        format!(
            "{median:.0} % (median), {least:.0} % (least) of the margin that 300 directions show"
        ),
    );
    let solver = ExactSolver::new(&arm, &config(1e-6))?;
    let beyond: Vec<(WallPlane, WallPoint)> = (0..300)
        .map(|_| {
            let plane = WallPlane::new(sampler.uniform(-0.8, 0.8), sampler.uniform(0.2, 0.8))?;
            let at = WallPoint::new(sampler.uniform(0.9, 1.3), sampler.uniform(-0.2, 1.2));
            Ok((plane, at))
        })
        .collect::<anyhow::Result<_>>()?;
    let nearest = time_each(beyond.len(), |i| {
        solver.nearest_reachable(&beyond[i].0, beyond[i].1).is_ok()
    });
    row(
        "nearest reachable point of a wall",
        &nearest,
        "1e-5 m to the nearest that a sweep of 1.5 % of the arm sees".to_owned(),
    );
    let walls: Vec<WallGrid> = (0..200)
        .map(|_| {
            let (point, normal) = places[sampler.index(n)];
            Ok(WallGrid::for_wall(
                point,
                normal,
                Interval::new(-0.25, 1.25),
                0.05,
            )?)
        })
        .collect::<anyhow::Result<_>>()?;
    let one_wall = time_each(walls.len(), |i| {
        ReachabilityMap::build(&arm, &config(1e-6), vec![walls[i].clone()]).is_ok()
    });
    row(
        "map of one wall, 31 heights",
        &one_wall,
        "1e-6 m, proven".to_owned(),
    );

    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut polygons = MarkdownTable::new([
        "Hausdorff accuracy",
        "a plane, median",
        "p99",
        "266 planes, one core",
        &format!("{cores} cores"),
        "corners a plane",
        "largest area error",
    ]);
    let planes: Vec<WallPlane> = published::grids()?
        .iter()
        .flat_map(|wall| (0..wall.distances.count()).map(|i| wall.plane(i)))
        .collect::<Result<_, _>>()?;
    // The area error is measured on some of the planes; the finest polygon is the reference.
    let fine = PolygonConfig {
        accuracy_m: 1e-6,
        ..PolygonConfig::default()
    };
    let some: Vec<&WallPlane> = planes.iter().step_by(12).collect();
    let areas: Vec<f64> = some
        .iter()
        .map(|plane| Ok(WallRegion::of_plane(&solver, plane, &fine)?.area_m2()))
        .collect::<anyhow::Result<_>>()?;
    let mut quoted = Vec::new();
    for accuracy_m in [1e-2, 1e-3, 1e-4, 1e-5] {
        let config = PolygonConfig {
            accuracy_m,
            ..PolygonConfig::default()
        };
        let one_by_one = time_each(planes.len(), |i| {
            WallRegion::of_plane(&solver, &planes[i], &config).is_ok()
        });
        let total_s = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()?;
            let start = Instant::now();
            let regions = pool.install(|| WallRegion::of_planes(&solver, &planes, &config))?;
            let corners: usize = regions.iter().map(|r| r.vertices().len()).sum();
            Ok::<_, anyhow::Error>((start.elapsed().as_secs_f64(), corners))
        };
        let ((one_s, corners), (all_s, _)) = (total_s(1)?, total_s(cores)?);
        let timing = one_by_one;
        let mut area_error: f64 = 0.0;
        for (plane, area) in some.iter().zip(&areas) {
            let region = WallRegion::of_plane(&solver, plane, &config)?;
            area_error = area_error.max((region.area_m2() - area).abs());
        }
        polygons.row([
            format_error(accuracy_m, "m"),
            format_ns(timing.median_ns),
            format_ns(timing.p99_ns),
            format!("{one_s:.2} s"),
            format!("{all_s:.2} s"),
            format!("{:.0}", corners as f64 / planes.len() as f64),
            format_error(area_error, "m²"),
        ]);
        if accuracy_m == 1e-4 {
            quoted.push(SummaryRow::new(
                "reachability",
                "polygons of a plane",
                &timing,
                "0.1 mm Hausdorff",
            ));
        }
    }
    let mut text = String::from("### Reachability: queries\n\n");
    let _ = write!(
        text,
        "{table}\nPolygons with holes of every plane of the published grid (equal ones once), proof by squares of 1 cm included:\n\n{polygons}"
    );
    quoted.insert(
        0,
        SummaryRow::new("reachability", "look-up in a map", &look_up, "nearest line"),
    );
    quoted.insert(
        1,
        SummaryRow::new(
            "reachability",
            "certified margin",
            &margin,
            "a proven lower bound",
        ),
    );
    quoted.insert(
        2,
        SummaryRow::new(
            "reachability",
            "map of one wall, 31 heights",
            &one_wall,
            "1e-6 m, proven",
        ),
    );
    Ok(Section::of(text, quoted))
}

/// Distance to the nearest unreachable place along 300 random directions, m.
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
                if reachable(middle) {
                    lo = middle
                } else {
                    hi = middle
                }
            }
            least = hi;
        }
    }
    least
}
