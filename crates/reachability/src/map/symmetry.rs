//! Lines that are solved once and represent many: rotated about the base axis, and mirrored.
//!
//! A line is solved for the family of arms of all its images (`line/images.rs`). Where the narrowest and the widest arm of
//! the family agree, which is nearly everywhere, the line represents all of its images; elsewhere each image is solved
//! separately.

use super::grid::{BuildReport, WallGrid, checked_line_count};
use crate::error::Result;
use crate::line::{ExactConfig, ExactSolver, LineReachability, sectors};
use crate::progress::{Monitor, map_indexed};
use crate::wall::WallPlane;
use hwall_kinematics::SrsArm;
use std::collections::HashMap;

/// A line that represents others: its sector (see [`sectors`]), distance and height.
struct Task {
    sector: usize,
    distance_m: f64,
    height_m: f64,
}

/// Solves all lines of the grids.
pub(super) fn solve(
    arm: &SrsArm,
    config: &ExactConfig,
    walls: &[WallGrid],
    monitor: &Monitor,
) -> Result<(Vec<LineReachability>, BuildReport)> {
    let count = checked_line_count(walls)?;
    let direct = ExactSolver::new(arm, config)?;
    // Map each line to its representative.
    let mut keys: HashMap<(usize, u64, u64), usize> = HashMap::new();
    let mut tasks: Vec<Task> = Vec::new();
    let mut task_of = Vec::with_capacity(count);
    let headings: Vec<f64> = walls.iter().map(|wall| wall.heading_rad).collect();
    let sector_of = sectors(&headings);
    for (wall, &sector) in walls.iter().zip(&sector_of) {
        for distance in wall.distances.iter() {
            for height in wall.heights.iter() {
                let key = (sector, distance.to_bits(), height.to_bits());
                task_of.push(*keys.entry(key).or_insert_with(|| {
                    tasks.push(Task {
                        sector,
                        distance_m: distance,
                        height_m: height,
                    });
                    tasks.len() - 1
                }));
            }
        }
    }
    // First with mirror symmetry; then, for undecided lines, without it.
    let mut reduced: Vec<Option<LineReachability>> = vec![None; tasks.len()];
    let mut solved = 0;
    // Families do not help if a height or a roll is searched: where their arms differ, the search would not end.
    let stages: &[bool] = if direct.family().is_free() {
        &[]
    } else if direct.has_mirror() {
        &[true, false]
    } else {
        &[false]
    };
    for &mirror in stages {
        let families = families(&direct, &headings, &sector_of, mirror)?;
        let open: Vec<usize> = (0..tasks.len()).filter(|&i| reduced[i].is_none()).collect();
        let found = map_indexed(open.len(), monitor, |i| {
            let task = &tasks[open[i]];
            let line = WallPlane::new(0.0, task.distance_m)?.line(task.height_m);
            match &families[task.sector] {
                Some(solver) => solver.line_of_family(&line, mirror),
                None => Ok(None),
            }
        })?;
        solved += open.len();
        for (task, line) in open.into_iter().zip(found) {
            reduced[task] = line;
        }
    }

    // The images that symmetry leaves undecided.
    let mut open = Vec::new();
    let mut next = 0;
    for wall in walls {
        for line in wall.lines()? {
            if reduced[task_of[next]].is_none() {
                open.push((next, line));
            }
            next += 1;
        }
    }
    let singly = map_indexed(open.len(), monitor, |i| direct.line(&open[i].1))?;
    let mut lines: Vec<LineReachability> = task_of
        .iter()
        .map(|&task| reduced[task].clone().unwrap_or_default())
        .collect();
    let open_count = open.len();
    for ((index, _), reach) in open.into_iter().zip(singly) {
        lines[index] = reach;
    }
    let mut next = 0;
    for wall in walls {
        let of_wall = &mut lines[next..next + wall.line_count()];
        if let Some(span) = wall.span_m {
            of_wall
                .iter_mut()
                .for_each(|line| *line = line.clipped(span));
        }
        next += of_wall.len();
    }
    let report = BuildReport {
        lines: lines.len(),
        solved: solved + open_count,
        singly: open_count,
    };
    Ok((lines, report))
}

/// One solver per sector; `None` if the images share no angle of some joint.
fn families(
    direct: &ExactSolver,
    headings: &[f64],
    sector_of: &[usize],
    mirror: bool,
) -> Result<Vec<Option<ExactSolver>>> {
    let mut of_sector = vec![Vec::new(); sector_of.iter().max().map_or(0, |last| last + 1)];
    for (heading, sector) in headings.iter().zip(sector_of) {
        of_sector[*sector].push(*heading);
    }
    let solvers = of_sector
        .iter()
        .map(|headings| direct.of_images(headings, mirror));
    solvers.collect()
}
