//! Places that a person may touch.

use crate::error::ArrivalError;
use glam::DVec3;
use hwall_numeric::check::{finite, non_negative, positive};
use hwall_reachability::{Interval, LineIndex, Target, WallMaps};

/// A place that a person may touch, and how likely it is beside the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightedTarget {
    /// The place and the wall's normal towards the person.
    pub target: Target,
    /// Not negative; only the ratios count.
    pub weight: f64,
}

impl From<Target> for WeightedTarget {
    /// As likely as every other.
    fn from(target: Target) -> Self {
        Self {
            target,
            weight: 1.0,
        }
    }
}

/// How touches are spread over walls of different size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WallShare {
    /// Every wall is touched as often as every other: people touch things.
    #[default]
    Equal,
    /// In proportion to the area within reach.
    Area,
}

/// Where people touch walls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchRange {
    /// Heights above the base, m; default 0.15 to 1.3: from the hip to a little above the eyes of a person whose eyes
    /// are 1 m above the base.
    pub heights: Interval,
    /// Distance between places, m; default 0.1.
    pub spacing_m: f64,
    /// How touches are spread over the walls; default equally.
    pub share: WallShare,
    /// Centre and radius, m, of a ball that holds all places, such as the reach of a standing person; default none.
    pub ball: Option<(DVec3, f64)>,
}

impl Default for TouchRange {
    fn default() -> Self {
        Self {
            heights: Interval::new(0.15, 1.3),
            spacing_m: 0.1,
            share: WallShare::default(),
            ball: None,
        }
    }
}

/// A thinner grid than this is made where a wall would give more places.
const MOST_A_WALL: usize = 10_000;

/// Places within reach on the maps' walls that face away from the base, over the heights at which people touch.
///
/// The first side that a facet was mapped for counts only if the base stands behind it.
///
/// # Errors
/// A setting out of range, no walls, nothing within reach.
pub fn targets_of_maps(
    maps: &WallMaps,
    range: &TouchRange,
) -> Result<Vec<WeightedTarget>, ArrivalError> {
    let low_m = finite("lowest height", range.heights.lo_m)?;
    let high_m = finite("highest height", range.heights.hi_m)?;
    positive("spacing_m", range.spacing_m)?;
    if let Some((_, radius_m)) = range.ball {
        non_negative("radius of touches", radius_m)?;
    }
    let map = maps.map().ok_or(ArrivalError::NoWalls)?;
    let mut targets = Vec::new();
    let mut tried = 0;
    for (wall, grid) in map.walls().enumerate() {
        for plane in 0..grid.distances.count() {
            if grid.distances.at(plane) < 0.0 {
                continue;
            }
            let before = targets.len();
            let stride = ((range.spacing_m / grid.heights.spacing_m()).round() as usize).max(1);
            for height in (0..grid.heights.count()).step_by(stride) {
                let z_m = grid.heights.at(height);
                if z_m < low_m || z_m > high_m {
                    continue;
                }
                let index = LineIndex {
                    wall,
                    plane,
                    height,
                };
                let Some(line) = map.line(index) else {
                    continue;
                };
                for interval in map.intervals(index) {
                    let length_m = interval.span.length_m();
                    let count = ((length_m / range.spacing_m).floor() as usize).clamp(1, MOST_A_WALL);
                    tried += count;
                    for i in 0..count {
                        let share = (i as f64 + 0.5) / count as f64;
                        let point_m = line.point_m(interval.span.lo_m + share * length_m);
                        let near = |(middle_m, radius_m): (DVec3, f64)| point_m.distance(middle_m) <= radius_m;
                        if range.ball.is_none_or(near) {
                            let normal = line.plane.normal();
                            targets.push(WeightedTarget::from(Target { point_m, normal }));
                        }
                    }
                }
            }
            let count = targets.len() - before;
            if range.share == WallShare::Equal && count > 0 {
                for target in &mut targets[before..] {
                    target.weight = 1.0 / count as f64;
                }
            }
        }
    }
    if targets.is_empty() {
        return Err(ArrivalError::OutOfReach { places: tried });
    }
    Ok(targets)
}
