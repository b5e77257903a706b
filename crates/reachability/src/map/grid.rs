//! Which lines a map holds: headings, planes and heights.

use crate::error::finite;
use crate::{Interval, ReachabilityError, WallLine, WallPlane};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// More lines than this (about half a gigabyte of map) are refused before memory is taken.
pub const MOST_LINES: u128 = 1 << 22;

/// Evenly spaced values `first + i step`, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "(f64, f64, u32)", into = "(f64, f64, u32)")]
pub struct Steps {
    first_m: f64,
    step_m: f64,
    count: u32,
}

impl Steps {
    /// `count` values from `first_m` on; a negative step counts downwards.
    ///
    /// # Errors
    /// NaN or infinity, a step of zero, no values, or more than a map can hold.
    pub fn new(first_m: f64, step_m: f64, count: usize) -> Result<Self, ReachabilityError> {
        finite("first value", first_m)?;
        if finite("step", step_m)? == 0.0 {
            return Err(ReachabilityError::Parameter {
                what: "step",
                value: step_m,
                wanted: "anything but 0",
            });
        }
        if count == 0 {
            return Err(ReachabilityError::Empty { what: "values" });
        }
        finite("last value", first_m + step_m * count as f64)?;
        if count as u128 > MOST_LINES {
            return Err(too_many(count as u128));
        }
        Ok(Self {
            first_m,
            step_m,
            count: count as u32,
        })
    }

    /// From one end to the other, both included where the step divides the way.
    ///
    /// # Errors
    /// NaN or infinity, a step that is not positive, or more values than a map can hold.
    pub fn spanning(from_m: f64, to_m: f64, step_m: f64) -> Result<Self, ReachabilityError> {
        crate::error::positive("step", step_m)?;
        let way = finite("to", to_m)? - finite("from", from_m)?;
        // A last step that misses the end by rounding counts as whole.
        let steps = (finite("way in steps", way.abs() / step_m)? + 1e-9).floor();
        if steps >= MOST_LINES as f64 {
            return Err(too_many((steps as u128).saturating_add(1)));
        }
        Self::new(from_m, step_m.copysign(way), steps as usize + 1)
    }

    /// One value; a look-up within `reach_m` of it finds it.
    ///
    /// # Errors
    /// NaN or infinity, a reach that is not positive.
    pub fn single(value_m: f64, reach_m: f64) -> Result<Self, ReachabilityError> {
        crate::error::positive("reach of a single value", reach_m)?;
        Self::new(value_m, 2.0 * reach_m, 1)
    }

    /// How many.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.count as usize
    }

    /// Value `index`, m.
    #[must_use]
    pub fn at(&self, index: usize) -> f64 {
        self.first_m + self.step_m * index as f64
    }

    /// All values, m.
    pub fn iter(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.count()).map(|i| self.at(i))
    }

    /// Distance between neighbours, m.
    #[must_use]
    pub const fn spacing_m(&self) -> f64 {
        self.step_m.abs()
    }

    /// The nearest value's index, `None` further than half a step from all of them (or NaN).
    #[must_use]
    #[inline]
    pub fn nearest(&self, value_m: f64) -> Option<usize> {
        // Truncation instead of rounding, which is a call without SSE 4.1; NaN fails both
        // comparisons.
        let above = (value_m - self.first_m) / self.step_m + 0.5;
        (above >= 0.0 && above < f64::from(self.count)).then_some(above as usize)
    }
}

impl TryFrom<(f64, f64, u32)> for Steps {
    type Error = ReachabilityError;
    fn try_from((first_m, step_m, count): (f64, f64, u32)) -> Result<Self, Self::Error> {
        Self::new(first_m, step_m, count as usize)
    }
}

impl From<Steps> for (f64, f64, u32) {
    fn from(steps: Steps) -> Self {
        (steps.first_m, steps.step_m, steps.count)
    }
}

/// Parallel walls: one heading, several distances and heights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WallGrid {
    /// Heading γ of the normal, rad.
    pub heading_rad: f64,
    /// Distances `n · p` of the planes, m.
    pub distances: Steps,
    /// Heights above the base, m.
    pub heights: Steps,
    /// The part along the wall that counts, m; all of it without one.
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

    /// One wall of a scene: only its plane, only its heights.
    ///
    /// `point_m` and `normal` (towards the person) in the arm's base frame; `heights_m` from the
    /// wall's lower to its upper border; lines every `step_m`, both borders included.
    ///
    /// # Errors
    /// NaN or infinity, a normal that is not horizontal, a step that is not positive.
    pub fn for_wall(
        point_m: DVec3,
        normal: DVec3,
        heights_m: (f64, f64),
        step_m: f64,
    ) -> Result<Self, ReachabilityError> {
        let plane = WallPlane::through(point_m, normal)?;
        crate::error::positive("step", step_m)?;
        let (low, high) = heights_m;
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

    /// The same walls, ending on the left and on the right: from the smallest to the largest place
    /// along the wall of these points (corners of a wall, base frame, m).
    ///
    /// # Errors
    /// No points, NaN or infinity.
    pub fn within(
        self,
        points_m: impl IntoIterator<Item = DVec3>,
    ) -> Result<Self, ReachabilityError> {
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

    /// How many lines.
    #[must_use]
    pub fn line_count(&self) -> usize {
        self.distances.count() * self.heights.count()
    }

    /// Plane `index`.
    ///
    /// # Errors
    /// NaN or infinity in the heading.
    pub fn plane(&self, index: usize) -> Result<WallPlane, ReachabilityError> {
        WallPlane::new(self.heading_rad, self.distances.at(index))
    }

    /// All lines, plane by plane, height by height.
    pub(crate) fn lines(&self) -> Result<Vec<WallLine>, ReachabilityError> {
        let mut lines = Vec::with_capacity(self.line_count());
        for index in 0..self.distances.count() {
            let plane = self.plane(index)?;
            lines.extend(self.heights.iter().map(|height| plane.line(height)));
        }
        Ok(lines)
    }
}

fn too_many(count: u128) -> ReachabilityError {
    ReachabilityError::TooMany {
        what: "values or lines",
        count,
        limit: MOST_LINES,
    }
}

/// Rejects grids that do not fit, before anything is allocated for them.
pub(crate) fn checked_line_count(walls: &[WallGrid]) -> Result<usize, ReachabilityError> {
    if walls.is_empty() {
        return Err(ReachabilityError::Empty { what: "walls" });
    }
    let mut count: u128 = 0;
    for wall in walls {
        finite("heading_rad", wall.heading_rad)?;
        if let Some(span) = wall.span_m {
            let length = finite("end of a wall", span.length_m())?;
            crate::error::non_negative("length of a wall", length)?;
        }
        count += wall.distances.count() as u128 * wall.heights.count() as u128;
    }
    if count > MOST_LINES {
        return Err(too_many(count));
    }
    Ok(count as usize)
}
