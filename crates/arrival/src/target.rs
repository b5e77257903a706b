//! Places that a person may touch.

use crate::error::ArrivalError;
use glam::DVec3;
use hwall_numeric::check::{all_finite, finite, non_negative, positive};
use hwall_reachability::{Interval, Target, WallFacet, WallMaps, WallPlane, WallPoint};

/// A place that a person may touch, and its relative probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightedTarget {
    /// The place and the wall's normal towards the person.
    pub target: Target,
    /// Not negative; only the ratios count.
    pub weight: f64,
    /// Required roll of the board about the normal, rad, e.g. for a texture; half a turn further is equivalent. `None`: any roll of the settings.
    pub roll_rad: Option<f64>,
}

impl From<Target> for WeightedTarget {
    /// With the same weight as every other.
    fn from(target: Target) -> Self {
        Self {
            target,
            weight: 1.0,
            roll_rad: None,
        }
    }
}

/// Distribution of touches over walls of different size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WallShare {
    /// The same for every wall: people touch things.
    #[default]
    Equal,
    /// In proportion to the reachable area.
    Area,
}

/// Range of the touches on walls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchRange {
    /// Heights above the base, m; default 0.15 to 1.3: from the hip to a little above the eyes of a person whose eyes are 1 m above the base.
    pub heights: Interval,
    /// Spacing of places, m; default 0.1.
    pub spacing_m: f64,
    /// Distance from the borders of a wall, m; default 0.08, a hand's breadth.
    pub inset_m: f64,
    /// Distribution of touches over the walls; default equal.
    pub share: WallShare,
    /// Centre and radius, m, of a ball that contains all places, e.g. the reach of a standing person; default none.
    pub ball: Option<(DVec3, f64)>,
}

impl Default for TouchRange {
    fn default() -> Self {
        Self {
            heights: Interval::new(0.15, 1.3),
            spacing_m: 0.1,
            inset_m: 0.08,
            share: WallShare::default(),
            ball: None,
        }
    }
}

/// More places on one wall are rejected before memory is allocated.
const MOST_A_WALL: usize = 100_000;

/// Reachable places on the walls of maps, on the outer side of each facet, within the touched heights. A wall counts only if the base stands behind
/// it.
///
/// # Errors
/// A setting out of range, no walls, nothing within reach.
pub fn targets_of_maps(
    maps: &WallMaps,
    range: &TouchRange,
) -> Result<Vec<WeightedTarget>, ArrivalError> {
    let map = maps.map().ok_or(ArrivalError::NoWalls)?;
    let is_reachable = |plane: &WallPlane, point_m| {
        Ok(plane.distance_m() >= 0.0 && map.is_reachable(point_m, plane.normal())?)
    };
    chosen(maps.facets(), range, is_reachable)
}

/// Places on facets, on the outer side of each, within the touched heights: for a base without a position yet. Heights and ball are in the frame of
/// the facets.
///
/// # Errors
/// A setting out of range, a facet that is not vertical, no facets with a place in the range.
pub fn targets_of_facets(
    facets: &[WallFacet],
    range: &TouchRange,
) -> Result<Vec<WeightedTarget>, ArrivalError> {
    if facets.is_empty() {
        return Err(ArrivalError::NoWalls);
    }
    chosen(facets, range, |_, _| Ok(true))
}

fn chosen(
    facets: &[WallFacet],
    range: &TouchRange,
    counts: impl Fn(&WallPlane, DVec3) -> Result<bool, ArrivalError>,
) -> Result<Vec<WeightedTarget>, ArrivalError> {
    range.validate()?;
    let mut targets = Vec::new();
    let mut tried = 0;
    for facet in facets {
        let plane = WallPlane::through(facet.point_m, facet.normal)?;
        let before = targets.len();
        for point_m in range.places_of(&plane, facet)? {
            tried += 1;
            if counts(&plane, point_m)? {
                let normal = plane.normal();
                targets.push(WeightedTarget::from(Target { point_m, normal }));
            }
        }
        let count = targets.len() - before;
        if range.share == WallShare::Equal && count > 0 {
            for target in &mut targets[before..] {
                target.weight = 1.0 / count as f64;
            }
        }
    }
    if targets.is_empty() {
        return Err(ArrivalError::OutOfReach { places: tried });
    }
    Ok(targets)
}

impl TouchRange {
    /// Rejects settings out of range.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is always outside.
    pub fn validate(&self) -> Result<(), ArrivalError> {
        finite("lowest height", self.heights.lo_m)?;
        finite("highest height", self.heights.hi_m)?;
        positive("spacing_m", self.spacing_m)?;
        non_negative("inset_m", self.inset_m)?;
        if let Some((middle_m, radius_m)) = self.ball {
            all_finite("middle of the ball", &middle_m.to_array())?;
            non_negative("radius of the ball", radius_m)?;
        }
        Ok(())
    }

    /// The places of a facet: an even grid within its borders.
    fn places_of(&self, plane: &WallPlane, facet: &WallFacet) -> Result<Vec<DVec3>, ArrivalError> {
        let mut along = Interval::new(f64::INFINITY, f64::NEG_INFINITY);
        for corner in &facet.outline_m {
            let s_m = plane.along().dot(*corner);
            along = Interval::new(along.lo_m.min(s_m), along.hi_m.max(s_m));
        }
        let inside = |span: Interval| {
            let (lo, hi) = (span.lo_m + self.inset_m, span.hi_m - self.inset_m);
            Interval::new(lo, hi)
        };
        let (along, borders) = (inside(along), inside(facet.heights));
        let heights = Interval::new(
            borders.lo_m.max(self.heights.lo_m),
            borders.hi_m.min(self.heights.hi_m),
        );
        let count = |span: Interval| match span.length_m() / self.spacing_m {
            cells if cells >= 0.0 => cells.floor() + 1.0,
            _ => 0.0,
        };
        let (columns, rows) = (count(along), count(heights));
        if columns * rows > MOST_A_WALL as f64 {
            return Err(ArrivalError::TooMany {
                what: "places of a wall",
                count: (columns * rows) as u128,
                limit: MOST_A_WALL as u128,
            });
        }
        let at = |span: Interval, i: usize, count: f64| {
            span.lo_m + span.length_m() * (i as f64 + 0.5) / count
        };
        let mut places = Vec::with_capacity((columns * rows) as usize);
        for row in 0..rows as usize {
            for column in 0..columns as usize {
                let point = WallPoint::new(at(along, column, columns), at(heights, row, rows));
                let point_m = plane.point_m(point);
                let near =
                    |(middle_m, radius_m): (DVec3, f64)| point_m.distance(middle_m) <= radius_m;
                if self.ball.is_none_or(near) {
                    places.push(point_m);
                }
            }
        }
        Ok(places)
    }
}
