//! The lines of whole walls for any arm.

use super::solver::{LineExtremes, OptimizationSolver};
use crate::error::Result;
use crate::map::{GridLines, LEAST_COSINE_SQUARED, WallGrid, checked_line_count};
use crate::progress::{Monitor, Progress};
use crate::wall::WallLine;
use glam::DVec3;

/// The reachable part of some walls for a chain: one interval per line, found by optimization.
///
/// For arms with a closed form [`ReachabilityMap`](crate::ReachabilityMap) is exact, proven and thousands of times faster.
/// Here an end may be too near if no start led to the true end, and holes between the ends are not detected. Each end has
/// a configuration that reaches it ([`Extreme::q`](super::Extreme::q)).
///
/// ```
/// use glam::DVec3;
/// use hwall_kinematics::Chain;
/// use hwall_reachability::{ChainMap, Interval, OptimizationConfig, OptimizationSolver, Progress, WallGrid};
/// use std::ops::ControlFlow;
///
/// let solver = OptimizationSolver::new(&Chain::iiwa7(), OptimizationConfig::default())?;
/// let heights = Interval::new(0.2, 0.6);
/// let wall = WallGrid::for_wall(DVec3::new(0.6, 0.0, 0.0), DVec3::X, heights, 0.1)?;
/// let map = ChainMap::build(&solver, vec![wall], &|_: Progress| ControlFlow::Continue(()))?;
/// assert_eq!(map.look_up(DVec3::new(0.6, 0.3, 0.5), DVec3::X), Some(true));
/// assert_eq!(map.look_up(DVec3::new(0.6, 3.0, 0.5), DVec3::X), Some(false));
/// assert_eq!(map.look_up(DVec3::new(0.9, 0.3, 0.5), DVec3::X), None); // another plane
/// # Ok::<(), hwall_reachability::ReachabilityError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ChainMap {
    walls: Vec<GridLines>,
    lines: Vec<(WallLine, Option<LineExtremes>)>,
}

impl ChainMap {
    /// Solves all lines of the walls. The lines of a plane are solved in sequence, so that the ends of one line are
    /// starts for the next ([`OptimizationSolver::sweep`]). The monitor is called per plane and can cancel.
    ///
    /// # Errors
    /// No walls, NaN or infinity in one, more lines than fit; [`ReachabilityError::Cancelled`](crate::ReachabilityError::Cancelled) if the monitor
    /// stops it.
    pub fn build(
        solver: &OptimizationSolver,
        walls: Vec<WallGrid>,
        monitor: &Monitor,
    ) -> Result<Self> {
        let mut lines = Vec::with_capacity(checked_line_count(&walls)?);
        let total = walls.iter().map(|grid| grid.distances.count()).sum();
        let mut done = 0;
        let mut own = Vec::with_capacity(walls.len());
        for grid in walls {
            let first_line = lines.len();
            for plane in grid.lines()?.chunks(grid.heights.count()) {
                let found = solver.sweep(plane, &mut |_| monitor(Progress { done, total }))?;
                lines.extend(plane.iter().copied().zip(found));
                done += 1;
            }
            own.push(GridLines::new(grid, first_line)?);
        }
        Ok(Self { walls: own, lines })
    }

    /// Every line with its extremes, wall by wall, plane by plane, height by height; `None` if nothing was found.
    pub fn lines(&self) -> impl ExactSizeIterator<Item = (&WallLine, Option<&LineExtremes>)> {
        self.lines
            .iter()
            .map(|(line, found)| (line, found.as_ref()))
    }

    /// Whether the point is in the interval of the nearest line. `point_m` and the wall's outward normal (about horizontal,
    /// any length) in the base frame.
    ///
    /// `None` if no line is near: for a heading more than 7.5 degrees from all walls, more than half a step outside the
    /// planes or heights, or for NaN. Beyond the ends of a wall the answer is `Some(false)`.
    #[must_use]
    pub fn look_up(&self, point_m: DVec3, normal: DVec3) -> Option<bool> {
        let across = normal.x * normal.x + normal.y * normal.y;
        let along = |wall: &GridLines| wall.normal.dot(normal);
        let is_near = |wall: &&GridLines| {
            along(wall) > 0.0 && along(wall).powi(2) >= LEAST_COSINE_SQUARED * across
        };
        let walls = self.walls.iter().filter(is_near);
        let near = walls.filter_map(|wall| {
            let line = wall.number(wall.nearest(point_m)?);
            let s_m = wall.normal.x * point_m.y - wall.normal.y * point_m.x;
            let is_on_wall = wall.grid.span_m.is_none_or(|span| span.contains(s_m));
            (!s_m.is_nan()).then_some((is_on_wall, along(wall), line, s_m))
        });
        // If one plane has several pieces, use the one that contains the point.
        let (is_on_wall, _, line, s_m) =
            near.max_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))?;
        let (_, found) = self.lines.get(line)?;
        let is_found = found.as_ref().is_some_and(|f| f.interval().contains(s_m));
        Some(is_on_wall && is_found)
    }

    /// Area found within the walls' ends and between their first and last heights, m², over all planes: the lines' lengths
    /// by the trapezoidal rule, as in [`PlaneMap::area_m2`](crate::PlaneMap::area_m2).
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        let area = |wall: &GridLines| -> f64 {
            let lines = &self.lines[wall.first..][..wall.grid.line_count()];
            let length = |found: &LineExtremes| {
                let own = found.interval();
                let span = wall.grid.span_m.unwrap_or(own);
                (own.hi_m.min(span.hi_m) - own.lo_m.max(span.lo_m)).max(0.0)
            };
            let length_of = |found: &Option<LineExtremes>| found.as_ref().map_or(0.0, length);
            let heights = wall.grid.heights;
            lines
                .chunks(heights.count())
                .map(|plane| heights.integral(plane.iter().map(|(_, found)| length_of(found))))
                .sum()
        };
        self.walls.iter().map(area).sum()
    }
}
