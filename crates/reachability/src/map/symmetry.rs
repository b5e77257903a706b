//! Lines that are solved once and stand for many: turned about the base's axis, and mirrored.
//!
//! Turning a wall about the base axis turns joint 1 alone. A mirror through the plane of base axis
//! and normal changes the signs of joints 1, 3, 5 and 7, and turns the flange by `2 r - π` at roll
//! r. So, but for the limits of those four joints, one line stands for all lines of its distance and
//! height, at every heading, and for its own mirror image. Each image of the line forbids its own
//! arc of a joint's circle. The line is solved once with all of the arcs forbidden (what is then
//! reachable is so in every image) and once with only the arcs that all images forbid (what is then
//! unreachable is so in every image). Where the two results agree, which is nearly everywhere, the
//! symmetry is proven; where they do not, each image is solved by itself.

use super::grid::{WallGrid, checked_line_count};
use crate::error::ReachabilityError;
use crate::line::{ExactConfig, ExactSolver, LineReachability, Roll, size_m};
use crate::progress::{Monitor, map_indexed};
use crate::wall::WallPlane;
use hwall_kinematics::{JointLimit, SrsArm};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// Every line of the grids in their order, and how many had to be solved.
pub(super) struct Solved {
    pub(super) lines: Vec<LineReachability>,
    pub(super) solved: usize,
    /// Of those, lines that the symmetry did not answer.
    pub(super) singly: usize,
}

/// A line that stands for others: its sector (see [`sectors`]), distance and height.
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
) -> Result<Solved, ReachabilityError> {
    let count = checked_line_count(walls)?;
    let direct = ExactSolver::new(arm, config)?;
    // Which line stands for which.
    let mut keys: HashMap<(usize, u64, u64), usize> = HashMap::new();
    let mut tasks: Vec<Task> = Vec::new();
    let mut task_of = Vec::with_capacity(count);
    let sector_of = sectors(walls);
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
    // First with the mirror, then without it what that leaves open.
    let mut reduced: Vec<Option<LineReachability>> = vec![None; tasks.len()];
    let mut solved = 0;
    // Families do not help where a height or a roll is searched: where their arms differ, the search
    // would go on for ever.
    let rolls = mirrored_rolls(arm, config);
    let stages = if direct.family().is_free() {
        [None, None]
    } else {
        [rolls.as_deref().map(Some), Some(None)]
    };
    for rolls in stages.into_iter().flatten() {
        let families = families(arm, config, walls, &sector_of, rolls)?;
        let open: Vec<usize> = (0..tasks.len()).filter(|&i| reduced[i].is_none()).collect();
        let found = map_indexed(open.len(), monitor, |i| {
            let task = &tasks[open[i]];
            let line = WallPlane::new(0.0, task.distance_m)?.line(task.height_m);
            match &families[task.sector] {
                Some(solver) => solver.line_of_family(&line, rolls.is_some()),
                None => Ok(None),
            }
        })?;
        solved += open.len();
        for (task, line) in open.into_iter().zip(found) {
            reduced[task] = line;
        }
    }

    // The images that the symmetry leaves open.
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
    Ok(Solved {
        lines,
        solved: solved + open_count,
        singly: open_count,
    })
}

/// One solver for each sector; `None` where the images have no angle of some joint in common.
fn families(
    arm: &SrsArm,
    config: &ExactConfig,
    walls: &[WallGrid],
    sector_of: &[usize],
    mirrored_rolls: Option<&[f64]>,
) -> Result<Vec<Option<ExactSolver>>, ReachabilityError> {
    let mut headings = vec![Vec::new(); sector_of.iter().max().map_or(0, |last| last + 1)];
    for (wall, sector) in walls.iter().zip(sector_of) {
        headings[*sector].push(wall.heading_rad);
    }
    let solvers = headings
        .iter()
        .map(|headings| match family(arm, headings, mirrored_rolls)? {
            Some((narrow, wide)) => ExactSolver::for_family(&narrow, &wide, config).map(Some),
            None => Ok(None),
        });
    solvers.collect()
}

/// Headings further apart than this are not solved together, rad: the more of joint 1's circle the
/// images forbid, the less is proven for all of them.
const WIDEST_SECTOR_RAD: f64 = 1.75;

/// Groups walls by heading: round the circle from the largest gap on.
fn sectors(walls: &[WallGrid]) -> Vec<usize> {
    let turned = |wall: &WallGrid| wall.heading_rad.rem_euclid(TAU);
    let mut order: Vec<usize> = (0..walls.len()).collect();
    order.sort_by(|&a, &b| turned(&walls[a]).total_cmp(&turned(&walls[b])));
    let gap_before = |i: usize| {
        let before = (i + order.len() - 1) % order.len();
        (turned(&walls[order[i]]) - turned(&walls[order[before]])).rem_euclid(TAU)
    };
    let start = (0..order.len())
        .max_by(|&a, &b| gap_before(a).total_cmp(&gap_before(b)))
        .unwrap_or(0);
    order.rotate_left(start);
    let mut sector_of = vec![0; walls.len()];
    let (mut sector, mut from) = (0, turned(&walls[order[0]]));
    for &wall in &order {
        let heading = turned(&walls[wall]);
        if (heading - from).rem_euclid(TAU) > WIDEST_SECTOR_RAD {
            (sector, from) = (sector + 1, heading);
        }
        sector_of[wall] = sector;
    }
    sector_of
}

/// The rolls of the flange, if the tool looks the same in the mirror (the flange turned).
fn mirrored_rolls(arm: &SrsArm, config: &ExactConfig) -> Option<Vec<f64>> {
    let tool = arm.flange_from_tool();
    let (x, z, p) = (
        tool.rotation().x_axis,
        tool.rotation().z_axis,
        tool.position_m(),
    );
    let turned = x.y.atan2(x.x);
    let aligned = z.x.hypot(z.y) < 1e-15 && z.z > 0.0 && p.x.hypot(p.y) < 1e-15 * size_m(arm);
    let rolls = match &config.roll {
        Roll::Fixed(roll) => vec![roll - turned],
        Roll::AnyOf(rolls) => rolls.iter().map(|roll| roll - turned).collect(),
        // The last joint is free then.
        Roll::Free => Vec::new(),
    };
    aligned.then_some(rolls)
}

/// The narrowest and the widest arm of all images.
fn family(
    arm: &SrsArm,
    headings: &[f64],
    mirrored_rolls: Option<&[f64]>,
) -> Result<Option<(SrsArm, SrsArm)>, ReachabilityError> {
    let (mut narrow, mut wide) = (*arm.limits(), *arm.limits());
    for joint in [0, 2, 4, 6] {
        let Some(forbidden) = Arc::forbidden_by(arm.limits()[joint]) else {
            continue;
        };
        let mut images: Vec<Arc> = match joint {
            0 => headings.iter().map(|h| forbidden.turned(-h)).collect(),
            _ => vec![forbidden],
        };
        if let Some(rolls) = mirrored_rolls {
            let mirrored: Vec<Arc> = images.iter().map(Arc::mirrored).collect();
            if joint == 6 {
                let turned = |r: &f64| forbidden.mirrored().turned(2.0 * r - PI);
                images.extend(rolls.iter().map(turned));
            } else {
                images.extend(mirrored);
            }
        }
        if images.iter().all(|arc| arc.is(&images[0])) {
            let limit = images[0].complement();
            (narrow[joint], wide[joint]) = (limit, limit);
        } else {
            let Some(common) = largest_gap(&images) else {
                return Ok(None);
            };
            (narrow[joint], wide[joint]) = (common, JointLimit::FREE);
        }
    }
    Ok(Some((arm.with_limits(narrow)?, arm.with_limits(wide)?)))
}

/// The angles that a limit forbids, as an open arc of the circle.
#[derive(Debug, Clone, Copy)]
struct Arc {
    middle: f64,
    half: f64,
}

impl Arc {
    fn forbidden_by(limit: JointLimit) -> Option<Self> {
        let width = limit.max_rad - limit.min_rad;
        (width < TAU).then_some(Self {
            middle: 0.5 * (limit.min_rad + limit.max_rad) + PI,
            half: PI - 0.5 * width,
        })
    }

    fn turned(&self, by: f64) -> Self {
        Self {
            middle: self.middle + by,
            ..*self
        }
    }

    fn mirrored(&self) -> Self {
        Self {
            middle: -self.middle,
            ..*self
        }
    }

    fn is(&self, other: &Self) -> bool {
        let turns = (self.middle - other.middle) / TAU;
        self.half == other.half && (turns - turns.round()).abs() < 1e-15
    }

    fn complement(&self) -> JointLimit {
        let middle = self.middle - PI;
        JointLimit {
            min_rad: middle - (PI - self.half),
            max_rad: middle + (PI - self.half),
        }
    }
}

/// The largest arc that no image forbids, if there is one.
fn largest_gap(forbidden: &[Arc]) -> Option<JointLimit> {
    let mut arcs: Vec<(f64, f64)> = forbidden
        .iter()
        .map(|arc| {
            let start = (arc.middle - arc.half).rem_euclid(TAU);
            (start, start + 2.0 * arc.half)
        })
        .collect();
    arcs.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Once round from the first start; what reaches beyond a full turn covers the first gaps too.
    let last = arcs[0].0 + TAU;
    let mut end = arcs.iter().map(|a| a.1 - TAU).fold(arcs[0].0, f64::max);
    let mut best: Option<(f64, f64)> = None;
    for &(start, stop) in arcs.iter().chain([&(last, last)]) {
        if start > end && best.is_none_or(|(lo, hi)| start - end > hi - lo) {
            best = Some((end, start));
        }
        end = end.max(stop);
    }
    best.map(|(min_rad, max_rad)| JointLimit { min_rad, max_rad })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(middle_deg: f64, half_deg: f64) -> Arc {
        Arc {
            middle: middle_deg.to_radians(),
            half: half_deg.to_radians(),
        }
    }

    #[test]
    fn the_largest_gap_goes_round_the_circle() {
        let width = |arcs: &[Arc]| {
            let gap = largest_gap(arcs)?;
            Some((gap.max_rad - gap.min_rad).to_degrees().round())
        };
        assert_eq!(width(&[arc(180.0, 10.0)]), Some(340.0));
        assert_eq!(width(&[arc(180.0, 10.0), arc(0.0, 10.0)]), Some(160.0));
        assert_eq!(width(&[arc(-170.0, 30.0), arc(170.0, 30.0)]), Some(280.0));
        assert_eq!(
            width(&[arc(350.0, 60.0), arc(20.0, 5.0), arc(100.0, 10.0)]),
            Some(180.0)
        );
        assert_eq!(width(&[arc(0.0, 100.0), arc(180.0, 100.0)]), None);
        assert_eq!(width(&[arc(10.0, 180.0), arc(30.0, 180.0)]), None);
    }
}
