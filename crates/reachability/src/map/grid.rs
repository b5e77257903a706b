//! The lines of a map: headings, planes and heights.

use crate::error::{ReachabilityError, Result};
use crate::line::Interval;
use crate::steps::{MOST_LINES, Steps, too_many};
use crate::wall::{WallLine, WallPlane};
use glam::DVec3;
use hwall_numeric::check::{finite, non_negative, positive};
use serde::{Deserialize, Serialize};

/// Parallel walls: one heading, several distances and heights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WallGrid {
    /// Heading γ of the normal, rad.
    pub heading_rad: f64,
    /// Distances `n · p` of the planes, m.
    pub distances: Steps,
    /// Heights above the base, m.
    pub heights: Steps,
    /// The part along the wall to use, m; `None` for all of it.
    pub span_m: Option<Interval>,
}

impl WallGrid {
    /// The dissertation's seven orientations, 15 degrees apart, of 38 planes at
    /// `0.926 - 0.05 k` m and 31 heights at `-0.26 + 0.05 j` m each ([H-Wall], IV.8).
    ///
    /// Its normals are `(cos g, -sin g, 0)`, so the headings are -g, from -45 to 45 degrees.
    #[must_use]
    pub fn dissertation() -> Vec<Self> {
        let steps = |first, step, count| Steps::new(first, step, count).expect("constants");
        (0..7)
            .map(|i| Self {
                heading_rad: (-45.0 + 15.0 * f64::from(i)).to_radians(),
                distances: steps(0.926, -0.05, 38),
                heights: steps(-0.26, 0.05, 31),
                span_m: None,
            })
            .collect()
    }

    /// One wall of a room: one plane and its heights.
    ///
    /// `point_m` and `normal` (towards the person) in the arm's base frame; `heights` from the wall's
    /// lower to its upper border, with a line on both borders and lines at most `step_m` apart.
    ///
    /// # Errors
    /// NaN or infinity, a normal that is not horizontal, a step that is not positive.
    pub fn for_wall(point_m: DVec3, normal: DVec3, heights: Interval, step_m: f64) -> Result<Self> {
        let plane = WallPlane::through(point_m, normal)?;
        positive("step", step_m)?;
        let (low, high) = (heights.lo_m, heights.hi_m);
        let height = finite("upper border", high)? - finite("lower border", low)?;
        let intervals = finite("height in steps", (height.abs() / step_m).ceil())?.max(1.0);
        if intervals >= MOST_LINES as f64 {
            return Err(too_many((intervals as u128).saturating_add(1)));
        }
        let heights = if height == 0.0 {
            Steps::new(low, step_m, 1)?
        } else {
            Steps::new(low, height / intervals, intervals as usize + 1)?
        };
        Ok(Self {
            heading_rad: plane.heading_rad(),
            distances: Steps::single(plane.distance_m(), 0.5 * step_m)?,
            heights,
            span_m: None,
        })
    }

    /// The same walls, limited to the extent of these points along the wall (corners of a wall, base frame, m).
    ///
    /// # Errors
    /// No points, NaN or infinity.
    pub fn within(self, points_m: impl IntoIterator<Item = DVec3>) -> Result<Self> {
        let along = WallPlane::new(self.heading_rad, 0.0)?.along();
        let mut span: Option<Interval> = None;
        for point in points_m {
            let s = finite("corner of a wall", along.dot(point))?;
            span = Some(span.map_or(Interval::new(s, s), |i| {
                Interval::new(i.lo_m.min(s), i.hi_m.max(s))
            }));
        }
        match span {
            None => Err(ReachabilityError::Empty {
                what: "corners of a wall",
            }),
            span_m => Ok(Self { span_m, ..self }),
        }
    }

    /// Number of lines.
    #[must_use]
    pub fn line_count(&self) -> usize {
        self.distances.count() * self.heights.count()
    }

    /// Plane `index`.
    ///
    /// # Errors
    /// NaN or infinity in the heading.
    pub fn plane(&self, index: usize) -> Result<WallPlane> {
        WallPlane::new(self.heading_rad, self.distances.at(index))
    }

    /// All lines, plane by plane, height by height.
    pub(crate) fn lines(&self) -> Result<Vec<WallLine>> {
        let mut lines = Vec::with_capacity(self.line_count());
        for index in 0..self.distances.count() {
            let plane = self.plane(index)?;
            lines.extend(self.heights.iter().map(|height| plane.line(height)));
        }
        Ok(lines)
    }
}

/// The lines of one grid within a map.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GridLines {
    pub(crate) grid: WallGrid,
    pub(crate) normal: DVec3,
    /// Index of its first line.
    pub(crate) first: usize,
}

impl GridLines {
    pub(crate) fn new(grid: WallGrid, first: usize) -> Result<Self> {
        let normal = WallPlane::new(grid.heading_rad, 0.0)?.normal();
        Ok(Self {
            grid,
            normal,
            first,
        })
    }

    /// Plane and height of the line nearest to a point, within half a step.
    #[inline]
    pub(crate) fn nearest(&self, point_m: DVec3) -> Option<[usize; 2]> {
        let distance = self.normal.x * point_m.x + self.normal.y * point_m.y;
        let plane = self.grid.distances.nearest(distance)?;
        Some([plane, self.grid.heights.nearest(point_m.z)?])
    }

    /// Index of a line.
    #[inline]
    pub(crate) fn number(&self, [plane, height]: [usize; 2]) -> usize {
        self.first + plane * self.grid.heights.count() + height
    }
}

/// Rejects grids that do not fit, before anything is allocated for them.
pub(crate) fn checked_line_count(walls: &[WallGrid]) -> Result<usize> {
    if walls.is_empty() {
        return Err(ReachabilityError::Empty { what: "walls" });
    }
    let mut count: u128 = 0;
    for wall in walls {
        finite("heading_rad", wall.heading_rad)?;
        if let Some(span) = wall.span_m {
            let length = finite("end of a wall", span.length_m())?;
            non_negative("length of a wall", length)?;
        }
        count += wall.distances.count() as u128 * wall.heights.count() as u128;
    }
    if count > MOST_LINES {
        return Err(too_many(count));
    }
    Ok(count as usize)
}

/// How a map was built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BuildReport {
    /// Lines in the map.
    pub lines: usize,
    /// Lines that were solved; the others are images of these.
    pub solved: usize,
    /// Lines that symmetry could not decide, each solved separately.
    pub singly: usize,
}
