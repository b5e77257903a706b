//! Reachability maps: the intervals of every line of some walls, and look-ups in them.

use super::grid::{BuildReport, GridLines, WallGrid};
use super::keep_out::{Carried, KeepOut, KeepOutBox, Plate, blocked};
use super::symmetry;
use crate::error::{ReachabilityError, Result};
use crate::line::{
    BoardPart, ExactConfig, ExactSolver, Interval, LineReachability, ReachableInterval, Roll,
    total_m,
};
use crate::progress::{Monitor, silent};
use crate::wall::{WallLine, WallPlane, WallPoint};
use glam::DVec3;
use hwall_kinematics::SrsArm;

/// Square of the cosine of the largest angle between wall and query normals in a look-up: half of
/// the dissertation's 15 degrees, plus a little for rounding.
pub(crate) const LEAST_COSINE_SQUARED: f64 = 0.982_962;

/// One line of a map: wall, plane and height.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LineIndex {
    /// Wall, in the order of the grids.
    pub wall: usize,
    /// Plane of the wall.
    pub plane: usize,
    /// Height on the plane.
    pub height: usize,
}

/// Result of a look-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LookUp {
    /// The nearest line.
    pub line: LineIndex,
    /// Position along the line, m.
    pub s_m: f64,
    /// True if it is in one of the line's intervals.
    pub reachable: bool,
}

/// Lengths of all lines of a map together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapLengths {
    /// Reachable, m.
    pub reachable_m: f64,
    /// Unproven, m.
    pub unknown_m: f64,
}

/// The reachable intervals of every line of some walls.
///
/// ```
/// use glam::DVec3;
/// use hwall_kinematics::SrsArm;
/// use hwall_reachability::{ExactConfig, Interval, ReachabilityMap, WallGrid};
///
/// // One wall of a room: 0.6 m before the arm, 1.2 m high, a line every 5 cm.
/// let heights = Interval::new(0.0, 1.2);
/// let wall = WallGrid::for_wall(DVec3::new(0.6, 0.0, 0.0), DVec3::X, heights, 0.05)?;
/// let map = ReachabilityMap::build(&SrsArm::iiwa7(), &ExactConfig::default(), vec![wall])?;
/// let found = map.look_up(DVec3::new(0.6, 0.3, 0.5), DVec3::X).expect("on the wall");
/// assert!(found.reachable);
/// # Ok::<(), hwall_reachability::ReachabilityError>(())
/// ```
#[derive(Debug, Clone)]
pub struct ReachabilityMap {
    solver: ExactSolver,
    arm: SrsArm,
    config: ExactConfig,
    walls: Vec<GridLines>,
    /// x and y of the walls' normals, contiguous for look-ups.
    normals: Vec<[f64; 2]>,
    /// Start of the intervals and the bands of each line; one entry more than lines.
    starts: Vec<[u32; 2]>,
    intervals: Vec<ReachableInterval>,
    unknown: Vec<Interval>,
    keep_out: Vec<KeepOut>,
    report: BuildReport,
}

/// Compares everything except the build report.
impl PartialEq for ReachabilityMap {
    fn eq(&self, other: &Self) -> bool {
        (&self.arm, &self.config, &self.walls, &self.starts)
            == (&other.arm, &other.config, &other.walls, &other.starts)
            && (&self.intervals, &self.unknown) == (&other.intervals, &other.unknown)
            && self.keep_out == other.keep_out
    }
}

impl ReachabilityMap {
    /// Solves all lines. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// An invalid configuration or grid, or too many lines.
    pub fn build(arm: &SrsArm, config: &ExactConfig, walls: Vec<WallGrid>) -> Result<Self> {
        Self::build_monitored(arm, config, walls, &silent)
    }

    /// As [`build`](Self::build), with progress reports; the monitor can cancel it.
    ///
    /// # Errors
    /// As [`build`](Self::build), or [`ReachabilityError::Cancelled`].
    pub fn build_monitored(
        arm: &SrsArm,
        config: &ExactConfig,
        walls: Vec<WallGrid>,
        monitor: &Monitor,
    ) -> Result<Self> {
        let (lines, report) = symmetry::solve(arm, config, &walls, monitor)?;
        let mut map = Self::from_lines(arm, config, walls, &lines, Vec::new())?;
        map.report = report;
        Ok(map)
    }

    /// From all lines of the grids in their order, with the parts blocked by keep-out boxes already removed.
    pub(super) fn from_lines(
        arm: &SrsArm,
        config: &ExactConfig,
        grids: Vec<WallGrid>,
        lines: &[LineReachability],
        keep_out: Vec<KeepOut>,
    ) -> Result<Self> {
        let mut walls = Vec::with_capacity(grids.len());
        let mut first_line = 0;
        for grid in grids {
            let count = grid.line_count();
            walls.push(GridLines::new(grid, first_line)?);
            first_line += count;
        }
        let mut starts = Vec::with_capacity(lines.len() + 1);
        let mut intervals = Vec::with_capacity(lines.iter().map(|l| l.intervals.len()).sum());
        let mut unknown = Vec::with_capacity(lines.iter().map(|l| l.unknown.len()).sum());
        for line in lines {
            starts.push([intervals.len() as u32, unknown.len() as u32]);
            intervals.extend_from_slice(&line.intervals);
            unknown.extend_from_slice(&line.unknown);
        }
        starts.push([intervals.len() as u32, unknown.len() as u32]);
        Ok(Self {
            solver: ExactSolver::new(arm, config)?,
            arm: arm.clone(),
            config: config.clone(),
            normals: walls.iter().map(|w| [w.normal.x, w.normal.y]).collect(),
            walls,
            starts,
            intervals,
            unknown,
            keep_out,
            report: BuildReport::default(),
        })
    }

    /// Removes the points where the load would overlap a box, in closed form. A point stays only if
    /// the load is clear of the boxes at every roll of the map's configuration; with a free roll, a
    /// board counts as the square around its circumscribed circle.
    ///
    /// # Errors
    /// NaN or infinity in the load, or a map where any part of the board counts.
    pub fn with_keep_out(self, boxes: Vec<KeepOutBox>, carried: Carried) -> Result<Self> {
        if self.config.board_part != BoardPart::Middle {
            return Err(ReachabilityError::NotBoardMiddle);
        }
        let carried = match (carried.plate, &self.config.roll) {
            (Some(plate), Roll::Free) => {
                let half = plate.half_width_m.hypot(plate.half_height_m);
                let plate = Some(Plate {
                    half_width_m: half,
                    half_height_m: half,
                    ..plate
                });
                Carried { plate, ..carried }
            }
            _ => carried,
        };
        let mut keep_out = self.keep_out.clone();
        keep_out.extend(boxes.into_iter().map(|solid| KeepOut { solid, carried }));
        let lines = self.lines().map(|index| {
            let found = LineReachability {
                intervals: self.intervals(index).to_vec(),
                unknown: self.unknown(index).to_vec(),
            };
            match self.line(index) {
                Some(line) => {
                    let blocked = blocked(&keep_out, &line, self.solver.rolls_rad())?;
                    Ok(found.unblocked(&blocked))
                }
                None => Ok(found),
            }
        });
        let lines: Vec<LineReachability> = lines.collect::<Result<_>>()?;
        let walls = self.walls().cloned().collect();
        let mut map = Self::from_lines(&self.arm, &self.config, walls, &lines, keep_out)?;
        map.report = self.report;
        Ok(map)
    }

    /// The keep-out boxes, each with the bodies carried past it.
    #[must_use]
    pub fn keep_out(&self) -> &[KeepOut] {
        &self.keep_out
    }

    /// The arm of the map, with its tool.
    #[must_use]
    pub const fn arm(&self) -> &SrsArm {
        &self.arm
    }

    /// Settings of the solver.
    #[must_use]
    pub const fn config(&self) -> &ExactConfig {
        &self.config
    }

    /// How the map was built; empty for a map from a file.
    #[must_use]
    pub const fn report(&self) -> BuildReport {
        self.report
    }

    /// The solver, for lines that are not in the map.
    #[must_use]
    pub const fn solver(&self) -> &ExactSolver {
        &self.solver
    }

    /// The grids of its walls.
    pub fn walls(&self) -> impl ExactSizeIterator<Item = &WallGrid> {
        self.walls.iter().map(|wall| &wall.grid)
    }

    /// The grid of a wall.
    #[cfg(feature = "exr")]
    pub(super) fn grid(&self, wall: usize) -> &WallGrid {
        &self.walls[wall].grid
    }

    /// All lines, wall by wall, plane by plane, height by height.
    pub fn lines(&self) -> impl Iterator<Item = LineIndex> + '_ {
        let walls = self.walls.iter().enumerate();
        walls.flat_map(|(wall, w)| {
            (0..w.grid.distances.count()).flat_map(move |plane| {
                (0..w.grid.heights.count()).map(move |height| LineIndex {
                    wall,
                    plane,
                    height,
                })
            })
        })
    }

    /// The geometry of a line; `None` for an index that is not in the map.
    #[must_use]
    pub fn line(&self, index: LineIndex) -> Option<WallLine> {
        self.flat(index)?;
        let grid = &self.walls[index.wall].grid;
        let plane = grid.plane(index.plane).ok()?;
        Some(plane.line(grid.heights.at(index.height)))
    }

    /// The reachable intervals of a line, sorted; empty for an index that is not in the map.
    #[inline]
    #[must_use]
    pub fn intervals(&self, index: LineIndex) -> &[ReachableInterval] {
        match self.flat(index) {
            Some(i) => &self.intervals[self.starts[i][0] as usize..self.starts[i + 1][0] as usize],
            None => &[],
        }
    }

    /// The unproven bands of a line, sorted.
    #[must_use]
    pub fn unknown(&self, index: LineIndex) -> &[Interval] {
        match self.flat(index) {
            Some(i) => &self.unknown[self.starts[i][1] as usize..self.starts[i + 1][1] as usize],
            None => &[],
        }
    }

    /// The dissertation's look-up: nearest orientation, plane and height, then the intervals.
    ///
    /// `point_m` and the wall's outward normal (about horizontal, any length) in the base frame.
    /// `None` if no line is near: for a heading more than 7.5 degrees from all walls, more than
    /// half a step outside the planes or heights, or for NaN. The verdict is that of the nearest
    /// line; for the point itself use [`is_reachable`](Self::is_reachable).
    #[must_use]
    pub fn look_up(&self, point_m: DVec3, normal: DVec3) -> Option<LookUp> {
        // First the best heading, without a branch in the loop; squared, so that the normal may
        // have any length. NaN and a zero normal find nothing.
        let along = |n: &[f64; 2]| n[0] * normal.x + n[1] * normal.y;
        let (mut most, mut wall) = (0.0, usize::MAX);
        for (i, n) in self.normals.iter().enumerate() {
            let here = along(n);
            wall = if here > most { i } else { wall };
            most = if here > most { here } else { most };
        }
        let across = normal.x * normal.x + normal.y * normal.y;
        let is_near = |along: f64| along > 0.0 && along * along >= LEAST_COSINE_SQUARED * across;
        if !is_near(most) {
            return None;
        }
        let line = self.nearest_of(wall, point_m).or_else(|| {
            // If that wall has no such plane, another wall may have it: walls of a scene share headings.
            let others = (0..self.walls.len()).filter(|&i| is_near(along(&self.normals[i])));
            let found = others.filter_map(|i| Some((i, self.nearest_of(i, point_m)?)));
            let best = found.max_by(|(i, _), (j, _)| {
                along(&self.normals[*i]).total_cmp(&along(&self.normals[*j]))
            });
            best.map(|(_, line)| line)
        })?;
        let n = self.walls[line.wall].normal;
        let s_m = n.x * point_m.y - n.y * point_m.x;
        let reachable = self.intervals(line).iter().any(|i| i.span.contains(s_m));
        Some(LookUp {
            line,
            s_m,
            reachable,
        })
    }

    /// The exact verdict at the point itself, on the wall through the point, instead of at the nearest line.
    ///
    /// # Errors
    /// NaN or infinity, a normal that is not horizontal.
    pub fn is_reachable(&self, point_m: DVec3, normal: DVec3) -> Result<bool> {
        let plane = WallPlane::through(point_m, normal)?;
        let at = plane.project(point_m).at;
        let line = plane.line(at.z_m);
        if !self.solver.is_reachable(&line, at.s_m)? {
            return Ok(false);
        }
        let blocked = blocked(&self.keep_out, &line, self.solver.rolls_rad())?;
        let inside = |hole: &Interval| hole.lo_m < at.s_m && at.s_m < hole.hi_m;
        Ok(!blocked.iter().any(inside))
    }

    /// The reachable point nearest to `at` on a plane's lines. Its distance exceeds that of the
    /// plane's nearest reachable point by at most half the height spacing. `None` if no point is
    /// reachable.
    ///
    /// The point stays `inset_m` away from the ends of its interval (in the middle of an interval
    /// too short for that), so that the arm is not exactly at a limit there.
    #[must_use]
    pub fn nearest_on_lines(
        &self,
        wall: usize,
        plane: usize,
        at: WallPoint,
        inset_m: f64,
    ) -> Option<WallPoint> {
        let heights = self.walls.get(wall)?.grid.heights;
        let mut best: Option<(f64, WallPoint)> = None;
        for height in 0..heights.count() {
            let z_m = heights.at(height);
            let index = LineIndex {
                wall,
                plane,
                height,
            };
            for interval in self.intervals(index) {
                let span = interval.span;
                let inset = inset_m.clamp(0.0, 0.5 * span.length_m());
                let s_m = at.s_m.max(span.lo_m + inset).min(span.hi_m - inset);
                let point = WallPoint::new(s_m, z_m);
                let distance = point.distance_m(at);
                if best.is_none_or(|(least, _)| distance < least) {
                    best = Some((distance, point));
                }
            }
        }
        best.map(|(_, point)| point)
    }

    /// Lengths of all lines together.
    #[must_use]
    pub fn lengths(&self) -> MapLengths {
        MapLengths {
            reachable_m: total_m(self.intervals.iter().map(|i| i.span.length_m())),
            unknown_m: total_m(self.unknown.iter().map(Interval::length_m)),
        }
    }

    /// Memory used, bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&*self.starts)
            + size_of_val(&*self.intervals)
            + size_of_val(&*self.unknown)
            + size_of_val(&*self.walls)
            + size_of::<Self>()
    }

    /// The nearest line of one wall.
    #[inline]
    fn nearest_of(&self, wall: usize, point_m: DVec3) -> Option<LineIndex> {
        let [plane, height] = self.walls[wall].nearest(point_m)?;
        Some(LineIndex {
            wall,
            plane,
            height,
        })
    }

    #[inline]
    fn flat(&self, index: LineIndex) -> Option<usize> {
        let wall = self.walls.get(index.wall)?;
        let heights = wall.grid.heights.count();
        let inside = index.plane < wall.grid.distances.count() && index.height < heights;
        inside.then(|| wall.number([index.plane, index.height]))
    }
}
